#include "tests/sensor_campaign/detection.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "control/planar.h"
#include "hal/seconds.h"
#include "identification/gap/parallel.h"
#include "tests/operation/sensor_rigs.h"

namespace sensor_campaign {
namespace {

using namespace std::chrono_literals;
using sensor_rigs::ArmRig;
using sensor_rigs::BaseRig;

constexpr double kBound_m = 0.1;
constexpr double kBound_rad = 0.2;
constexpr double kBound_s = 0.060;
/// How long a fault may take to show.
constexpr auto kBaseWindow = 1500ms;
constexpr auto kArmWindow = 3000ms;

constexpr std::array kBaseMotions{Motion::kFromRest, Motion::kStarting, Motion::kCreeping, Motion::kDriving};
constexpr std::array kArmMotions{Motion::kUnfolding, Motion::kApproach, Motion::kLed, Motion::kHeld};
constexpr int kDirections = 6;
constexpr int kHands = 2;

/// m/s, m/s and rad/s in B.
control::PlanarVector direction(int variant) {
  static const std::array<control::PlanarVector, kDirections> kAll{control::PlanarVector{0.3, 0, 0},
                                                                   {0, 0.3, 0},
                                                                   {0, 0, 0.6},
                                                                   {0.2, 0.15, 0.3},
                                                                   {-0.3, 0.05, 0},
                                                                   {0.1, -0.25, 0.2}};
  return kAll[static_cast<std::size_t>(variant)];
}

/// The truth at one time: the base's pose, or the arm's joints.
struct Truth {
  control::PlanarPose base;
  control::ArmVector arm_rad = control::ArmVector::Zero();
};

/// Of the joint that lies: a wheel moves the base.
Way between(const Truth& a, const Truth& b, std::size_t joint) {
  if (joint >= kWheels) {
    const auto arm = static_cast<Eigen::Index>(joint - kWheels);
    return {0.0, std::abs(a.arm_rad[arm] - b.arm_rad[arm])};
  }
  return {std::hypot(a.base.x_m - b.base.x_m, a.base.y_m - b.base.y_m),
          std::abs(std::remainder(a.base.yaw_rad - b.base.yaw_rad, 2 * std::numbers::pi))};
}

/// Where a run begins: all faults of a kind of joint share it.
struct Start {
  bool arm;
  Motion motion;
  int variant;
  friend bool operator<(const Start& a, const Start& b) {
    return std::tie(a.arm, a.motion, a.variant) < std::tie(b.arm, b.motion, b.variant);
  }
};

struct Ending {
  bool over = false;
  bool by_monitor = false;
  int joint = -1;
};

/// One run up to the lie, and on from there.
class BaseRun {
 public:
  static constexpr auto kWindow = kBaseWindow;
  BaseRun(const Start& start, const Conditions& conditions)
      : rig_(parameters(conditions.seed), conditions.off) {
    rig_.bus.hold_up(support::LateAnswers(conditions.late, conditions.seed));
    const Motion motion = start.motion;
    rig_.motion.tell(control::PlanarVector::Zero());
    rig_.run(500ms);
    const control::PlanarVector twist = direction(start.variant);
    rig_.motion.tell(motion == Motion::kCreeping ? control::PlanarVector(twist / 6) : twist);
    if (motion == Motion::kStarting) rig_.run(300ms);
    if (motion == Motion::kCreeping || motion == Motion::kDriving) rig_.run(2000ms);
  }
  void step(int /*k*/) { rig_.step(); }
  std::chrono::nanoseconds now() const { return rig_.clock.now(); }
  support::LyingRobot& liar() { return rig_.liar; }
  Truth truth() const { return {rig_.base.pose(), control::ArmVector::Zero()}; }
  Ending ending() const {
    const runtime::StopReason& reason = rig_.cycle.stop_reason();
    return {rig_.over(), reason.kind == runtime::StopReason::Kind::kRobotFault, reason.joint};
  }
  std::string explain() const { return describe(rig_.cycle.stop_reason(), rig_.robot); }

 private:
  static sim::BaseParameters parameters(std::uint32_t seed) {
    sim::BaseParameters parameters;
    parameters.noise_seed = seed;
    return parameters;
  }
  BaseRig rig_;
};

class ArmRun {
 public:
  static constexpr auto kWindow = kArmWindow;
  ArmRun(const Start& start, const Conditions& conditions)
      : random_(conditions.seed + static_cast<std::uint32_t>(start.variant)),
        rig_(scene(conditions.seed, start.motion), conditions.off) {
    rig_.bus.hold_up(support::LateAnswers(conditions.late, conditions.seed));
    const Motion motion = start.motion;
    if (motion == Motion::kUnfolding) {
      rig_.reach(control::TeleopPhase::kUnfolding);
      rig_.run(start.variant == 0 ? 0ms : 1500ms);
      return;
    }
    if (motion == Motion::kApproach) {
      rig_.reach(control::TeleopPhase::kApproaching);
      rig_.run(start.variant == 0 ? 1500ms : 2500ms);
      return;
    }
    rig_.reach(control::TeleopPhase::kOperating);
    if (motion == Motion::kLed) rig_.play(random_, 3600ms);
    if (motion == Motion::kHeld) rig_.run(1500ms);
    leads_ = true;
    rig_.run(motion == Motion::kLed ? 300ms : 0ms);
  }
  void step(int k) {
    constexpr int kNext = 900;
    if (leads_ && k % kNext == 0) {
      std::uniform_real_distribution<> both(-1, 1);
      rig_.hand.move_to({0.05 * both(random_), 0.04 * both(random_), 0.04 * both(random_)}, 700ms);
      rig_.hand.turn_to(Eigen::Quaterniond(Eigen::AngleAxisd(0.4 * both(random_), Eigen::Vector3d::UnitY())),
                        700ms);
    }
    rig_.step();
  }
  std::chrono::nanoseconds now() const { return rig_.clock.now(); }
  support::LyingRobot& liar() { return rig_.liar; }
  Truth truth() const { return {rig_.plant.pose(), rig_.plant.arm_rad()}; }
  Ending ending() const {
    const runtime::StopReason& reason = rig_.cycle.stop_reason();
    return {rig_.over(), reason.kind == runtime::StopReason::Kind::kRobotFault, reason.status.joint};
  }
  std::string explain() const { return describe(rig_.cycle.stop_reason(), rig_.robot, &rig_.master); }

 private:
  static teleop_rig::Scene scene(std::uint32_t seed, Motion motion) {
    teleop_rig::Scene scene =
        motion == Motion::kUnfolding ? teleop_rig::Scene{} : teleop_rig::unfolded_scene();
    scene.robot.wheels.noise_seed = seed;
    return scene;
  }
  std::mt19937 random_;
  ArmRig rig_;
  bool leads_ = false;
};

/// What happens in each cycle from the lie on, when nothing lies.
template <class Run>
std::vector<Truth> true_course(const Start& start, const Conditions& conditions) {
  Run run(start, conditions);
  std::vector<Truth> course;
  for (int k = 0; k < Run::kWindow / 1ms; ++k) {
    run.step(k);
    if (run.ending().over)
      throw std::runtime_error("no sensor lies, " + name_of(start.motion) + ": " + run.explain());
    course.push_back(run.truth());
  }
  return course;
}

template <class Run>
Detection detect_once(const DetectionCase& row, const Start& start, const std::vector<Truth>& course,
                      const Conditions& conditions) {
  Run run(start, conditions);
  const Truth begin = run.truth();
  const std::chrono::nanoseconds lied_from = run.now();
  const std::vector<support::SensorLie> lies = row.fault.on(row.joint);
  for (const support::SensorLie& lie : lies) run.liar().lie(lie);
  std::chrono::nanoseconds apparent_from = lied_from;
  Way travel;
  Detection result;
  result.runs = 1;
  int k = 0;
  for (; k < Run::kWindow / 1ms && !run.ending().over; ++k) {
    run.step(k);
    if (!run.liar().apparent()) apparent_from = run.now();
    const Truth truth = run.truth();
    travel.extend(between(truth, begin, row.joint));
    result.astray.extend(between(truth, course[static_cast<std::size_t>(k)], row.joint));
  }
  result.beyond = result.astray.share() > 1 ? 1 : 0;
  const double apparent_s = hal::seconds(run.now() - apparent_from);
  result.late = apparent_s > kBound_s ? 1 : 0;
  const Ending end = run.ending();
  if (end.over && end.by_monitor) {
    result.seen = 1;
    result.named =
        std::ranges::any_of(lies, [&](const auto& lie) { return end.joint == static_cast<int>(lie.joint); })
            ? 1
            : 0;
    result.misnamed = result.named == 0 && end.joint >= 0 ? 1 : 0;
    result.longest_apparent_s = apparent_s;
    result.longest_s = hal::seconds(run.now() - lied_from);
    result.travel = travel;
  } else if (end.over) {
    result.ended = 1;
  }
  return result;
}

}  // namespace

std::string name_of(Motion motion) {
  switch (motion) {
    case Motion::kFromRest: return "from rest";
    case Motion::kStarting: return "starting";
    case Motion::kCreeping: return "creeping";
    case Motion::kDriving: return "driving";
    case Motion::kUnfolding: return "unfolding";
    case Motion::kApproach: return "approach";
    case Motion::kLed: return "led";
    case Motion::kHeld: return "held, led";
  }
  return "";
}

std::span<const Motion> motions_of(std::size_t joint) {
  if (joint < kWheels) return kBaseMotions;
  return kArmMotions;
}

void Way::extend(const Way& other) {
  m = std::max(m, other.m);
  rad = std::max(rad, other.rad);
}

double Way::share() const { return std::max(m / kBound_m, rad / kBound_rad); }

void Detection::add(const Detection& other) {
  runs += other.runs;
  seen += other.seen;
  named += other.named;
  misnamed += other.misnamed;
  ended += other.ended;
  beyond += other.beyond;
  late += other.late;
  longest_s = std::max(longest_s, other.longest_s);
  longest_apparent_s = std::max(longest_apparent_s, other.longest_apparent_s);
  travel.extend(other.travel);
  astray.extend(other.astray);
}

std::vector<DetectionCase> detection_cases(const std::vector<SensorFault>& faults) {
  std::vector<DetectionCase> cases;
  for (const SensorFault& fault : faults)
    for (std::size_t joint = 0; joint < kJoints; ++joint) {
      if (!fault.concerns(joint)) continue;
      for (const Motion motion : motions_of(joint)) cases.push_back({fault, joint, motion});
    }
  return cases;
}

std::vector<Detection> detect(const std::vector<DetectionCase>& cases, const Conditions& conditions) {
  struct Work {
    std::size_t row;
    Start start;
  };
  std::map<Start, std::vector<Truth>> courses;
  std::vector<Work> work;
  for (std::size_t row = 0; row < cases.size(); ++row) {
    const bool arm = cases[row].joint >= kWheels;
    for (int variant = 0; variant < (arm ? kHands : kDirections); ++variant) {
      const Start start{arm, cases[row].motion, variant};
      courses[start];
      work.push_back({row, start});
    }
  }
  std::vector<std::pair<const Start, std::vector<Truth>>*> starts;
  for (auto& course : courses) starts.push_back(&course);
  identification::gap::in_parallel(starts.size(), [&](std::size_t i) {
    const Start& start = starts[i]->first;
    starts[i]->second =
        start.arm ? true_course<ArmRun>(start, conditions) : true_course<BaseRun>(start, conditions);
  });

  std::vector<Detection> each(work.size());
  identification::gap::in_parallel(work.size(), [&](std::size_t i) {
    const DetectionCase& row = cases[work[i].row];
    const Start& start = work[i].start;
    const std::vector<Truth>& course = courses.at(start);
    each[i] = start.arm ? detect_once<ArmRun>(row, start, course, conditions)
                        : detect_once<BaseRun>(row, start, course, conditions);
  });
  std::vector<Detection> results(cases.size());
  for (std::size_t i = 0; i < work.size(); ++i) results[work[i].row].add(each[i]);
  return results;
}

}  // namespace sensor_campaign
