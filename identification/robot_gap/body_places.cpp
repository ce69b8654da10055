#include "identification/robot_gap/body_places.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>

namespace identification::robot_gap {
namespace {

/// Motors and covers reach beyond the next joint.
constexpr double kBeyondItsLength = 1.5;
constexpr double kMoved_m = 1e-9;

/// Of each link, from its joint to the next one or to the tip.
std::vector<double> lengths_m(const control::SerialArm& arm) {
  std::vector<double> lengths;
  for (std::size_t link = 0; link < arm.links.size(); ++link) {
    const bool is_last = link + 1 == arm.links.size();
    lengths.push_back((is_last ? arm.X_LT : arm.links[link + 1].X_PL).translation().norm());
  }
  return lengths;
}

std::string place_text(const std::string& body, const std::string& from, double at_m, double reach_m) {
  char text[200];
  std::snprintf(text, sizeof text,
                " would have its centre of mass %.3g m from %s, beyond its reach of %.3g m: another cause "
                "stands behind this torque, or the masses are wrong",
                at_m, from.c_str(), reach_m);
  return body + text;
}

}  // namespace

std::vector<std::string> implausible_places(const control::ArmDescription& given,
                                            const control::ArmDescription& changed) {
  std::vector<std::string> sentences;
  const std::vector<double> length_m = lengths_m(given.arm);
  double whole_m = 0;
  for (std::size_t i = 0; i < length_m.size(); ++i) {
    whole_m += length_m[i];
    const control::ArmLink& link = given.arm.links[i];
    const Eigen::Vector3d& centre_m = changed.arm.links[i].inertia.p_LC_m;
    const double reach_m = kBeyondItsLength * std::max(length_m[i], link.inertia.p_LC_m.norm());
    if ((centre_m - link.inertia.p_LC_m).norm() > kMoved_m && reach_m > 0 && centre_m.norm() > reach_m)
      sentences.push_back(place_text(link.link, "its joint " + link.joint, centre_m.norm(), reach_m));
  }
  if ((changed.p_TP_m - given.p_TP_m).norm() > kMoved_m && whole_m > 0 && changed.p_TP_m.norm() > whole_m)
    sentences.push_back(place_text("the payload", "the tip", changed.p_TP_m.norm(), whole_m));
  return sentences;
}

}  // namespace identification::robot_gap
