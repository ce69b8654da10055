#include "identification/fit/sampling.h"

#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "identification/fit/statistics.h"

namespace identification::fit {

double even_period_s(const Recording& recording) {
  const std::span<const double> time = recording.column("time_s");
  const std::string rig = recording.rig.empty() ? "an unnamed rig" : recording.rig;
  if (time.size() < 100)
    throw std::invalid_argument("recording of " + rig + ": " + std::to_string(time.size()) +
                                " rows are too few to identify motion from; 100 are the least");
  std::vector<double> steps;
  for (std::size_t i = 1; i < time.size(); ++i) steps.push_back(time[i] - time[i - 1]);
  const double period = median(steps);
  std::size_t uneven = 0;
  for (const double step : steps) uneven += std::abs(step - period) > 0.5 * period ? 1 : 0;
  if (100 * uneven > steps.size())
    throw std::invalid_argument("recording of " + rig + ": " + std::to_string(uneven) +
                                " time steps differ from the usual " + std::to_string(period) +
                                " s by more than half; record at an even rate");
  return period;
}

}  // namespace identification::fit
