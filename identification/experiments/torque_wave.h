/// @file
/// A periodic torque without feedback: `presliding` below stiction (thesis 2.5.2, figure 23, and with an
/// offset figure 24) and `multisine` above it.
#pragma once
#include <string>

#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/multisine.h"
#include "identification/experiments/parameter.h"

namespace identification::experiments {

struct PreslidingConfig {
  std::string waveform = "multisine";  ///< or "sine", at the lowest frequency
  double peak_Nm = 0.04;               ///< below the breakaway of the weakest wheel, 0.058
  double offset_Nm = 0;                ///< around which it swings
  double lowest_Hz = 0.1;
  double highest_Hz = 5.0;
  double period_s = 10.0;
  double rest_s = 2.0;
  int periods = 5;
  int repeats = 1;

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"waveform", "multisine, or sine at the lowest frequency"}, waveform);
    v(Parameter{"peak_Nm", "largest torque of the wave; keep below stiction, with the offset", 1e-4, 20},
      peak_Nm);
    v(Parameter{"offset_Nm", "torque around which the wave swings; rises during the first period", -20, 20},
      offset_Nm);
    v(Parameter{"lowest_Hz", "lowest frequency", 1e-3, 100}, lowest_Hz);
    v(Parameter{"highest_Hz", "highest frequency", 1e-3, 100}, highest_Hz);
    v(Parameter{"period_s", "after which the signal repeats", 0.1, 600}, period_s);
    v(Parameter{"rest_s", "time without torque beforehand", 0, 600}, rest_s);
    v(Parameter{"periods", "consecutive periods", 1, 1000}, periods);
    v(Parameter{"repeats", "repetitions of the whole experiment", 1, 1000}, repeats);
  }
};

struct MultisineConfig {
  double peak_Nm = 0.3;  ///< the weakest wheel then turns at up to 9 rad/s
  double lowest_Hz = 0.1;
  double highest_Hz = 5.0;
  double period_s = 10.0;
  double rest_s = 2.0;
  int periods = 6;
  int repeats = 1;

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"peak_Nm", "largest torque", 1e-4, 20}, peak_Nm);
    v(Parameter{"lowest_Hz", "lowest frequency", 1e-3, 100}, lowest_Hz);
    v(Parameter{"highest_Hz", "highest frequency", 1e-3, 100}, highest_Hz);
    v(Parameter{"period_s", "after which the signal repeats", 0.1, 600}, period_s);
    v(Parameter{"rest_s", "time without torque beforehand", 0, 600}, rest_s);
    v(Parameter{"periods", "consecutive periods", 1, 1000}, periods);
    v(Parameter{"repeats", "repetitions of the whole experiment", 1, 1000}, repeats);
  }
};

/// One measurement: rest, then the periods. The recording is the result; the summary reports whether a
/// presliding test stayed in presliding and, with an offset, how far the minima of position moved on from one
/// period to the next: a contact that slips slightly at any load creeps under a torque that swings to one
/// side.
class TorqueWave final : public JointExperiment {
 public:
  TorqueWave(const PreslidingConfig& config, double period_s);
  TorqueWave(const MultisineConfig& config, double period_s);

  const Multisine& wave() const noexcept { return wave_; }

  RecordedCommands recorded_commands() const noexcept override { return {.torque = true}; }
  int measurement_count() const noexcept override { return repeats_; }
  double duration_s(int measurement) const noexcept override;
  void begin(int measurement, const Reading& reading) noexcept override;
  SetPoint step(const Reading& reading) noexcept override;
  bool finished() const noexcept override { return finished_; }
  std::span<const char* const> result_columns() const noexcept override;
  void write_result(std::span<double> values) const noexcept override;

 private:
  Multisine wave_;
  double period_s_;
  double offset_Nm_ = 0.0;
  double rest_s_;
  double played_s_;
  int repeats_;
  double origin_rad_ = 0.0;
  double largest_rad_ = 0.0;
  double last_rad_ = 0.0;
  int period_ = 0;                      // the current one
  double lowest_rad_ = kUnknown;        // in it
  double first_lowest_rad_ = kUnknown;  // in the first one after the offset has risen
  double last_lowest_rad_ = kUnknown;   // in the last finished one
  bool finished_ = false;
};

}  // namespace identification::experiments
