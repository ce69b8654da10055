#include "identification/gap/measured_gap.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "identification/gap/closed_loop.h"
#include "identification/gap/diagnosis.h"
#include "identification/gap/excerpts.h"
#include "identification/gap/sensor_offset.h"

namespace identification::gap {
namespace {

std::vector<Signals> prepared(const model::effects::DriveModel& base, std::vector<Source> data,
                              const Enough& enough, std::vector<Diagnosis>& diagnosis) {
  if (base.servo) {
    unwrap_positions(data, diagnosis);
    add_servo_torques(data, *base.servo);
  }
  Diagnosed looked = diagnose(std::move(data), base);
  remove_sensor_offset(looked.sources, base);
  std::ranges::move(looked.diagnosis, std::back_inserter(diagnosis));
  const Band band = choose_band(looked.sources, base);
  const auto judges = [](std::size_t, double) { return true; };
  const std::vector<Excerpt> excerpts = chosen_excerpts(looked.sources, band, judges, enough);
  std::ranges::move(left_out(looked.sources, excerpts), std::back_inserter(diagnosis));
  return signals_of(looked.sources, excerpts, band);
}

}  // namespace

MeasuredGap::MeasuredGap(const model::effects::DriveModel& base, std::vector<Source> data,
                         const Enough& enough)
    : signals_(std::make_unique<std::vector<Signals>>(prepared(base, std::move(data), enough, diagnosis_))),
      rows_(*signals_) {
  if (rows_.count() == 0)
    throw std::invalid_argument(
        "the recordings have no stretch in motion that is long enough to compare a torque");
}

double MeasuredGap::gap_Nm(const model::effects::DriveModel& model, const Added& added) const {
  const Eigen::VectorXd predicted = rows_.column([&](const Signals& s) {
    std::vector<double> torque_Nm = predicted_torque_Nm(model, s);
    if (added) {
      const std::vector<double> more_Nm = added(s);
      for (std::size_t i = 0; i < torque_Nm.size(); ++i) torque_Nm[i] += more_Nm[i];
    }
    return torque_Nm;
  });
  return std::sqrt((rows_.torque_Nm() - predicted).squaredNorm() / static_cast<double>(rows_.count()));
}

std::vector<double> MeasuredGap::speeds_rad_per_s() const {
  std::vector<double> speeds;
  for (const Signals& s : *signals_)
    for (std::size_t i = 0; i < s.size(); ++i)
      if (s.moving[i] > 0) speeds.push_back(std::abs(s.velocity_rad_per_s[i]));
  return speeds;
}

}  // namespace identification::gap
