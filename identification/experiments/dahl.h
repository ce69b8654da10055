/// @file
/// The loop of torque against displacement below stiction (thesis 2.5.2, figures 19 and 20).
#pragma once
#include <array>
#include <cstdint>

#include "identification/experiments/joint_experiment.h"
#include "identification/experiments/parameter.h"

namespace identification::experiments {

struct DahlConfig {
  double amplitude_Nm = 0.045;  ///< below the breakaway of the weakest wheel, 0.058
  double frequency_Hz = 0.1;
  int cycles = 10;      ///< 7 to 10 are representative (thesis)
  double centre = 0.5;  ///< the slope is fitted where the torque is below this share of the amplitude
  double rest_s = 2.0;
  int repeats = 1;

  template <typename Visitor>
  void visit(Visitor&& v) {
    v(Parameter{"amplitude_Nm", "of the sine; keep below stiction", 1e-4, 20}, amplitude_Nm);
    v(Parameter{"frequency_Hz", "of the sine", 1e-3, 10}, frequency_Hz);
    v(Parameter{"cycles", "periods of the sine; the first one only settles", 2, 1000}, cycles);
    v(Parameter{"centre", "share of the amplitude over which the slope is taken", 0.05, 1}, centre);
    v(Parameter{"rest_s", "time without torque beforehand", 0, 600}, rest_s);
    v(Parameter{"repeats", "repetitions of the whole experiment", 1, 1000}, repeats);
  }
};

/// Least squares y ≈ a + b·x, one pass. Cycle: add().
class SlopeFit {
 public:
  void add(double x, double y) noexcept {
    ++count_;
    const double off = x - mean_x_;
    mean_x_ += off / static_cast<double>(count_);
    const double y_off = y - mean_y_;
    mean_y_ += y_off / static_cast<double>(count_);
    squares_ += off * (x - mean_x_);
    products_ += off * (y - mean_y_);
    y_squares_ += y_off * (y - mean_y_);
  }
  double squares() const noexcept { return squares_; }
  double products() const noexcept { return products_; }
  double y_squares() const noexcept { return y_squares_; }
  double count() const noexcept { return static_cast<double>(count_); }

 private:
  std::int64_t count_ = 0;
  double mean_x_ = 0.0;
  double mean_y_ = 0.0;
  double squares_ = 0.0;
  double products_ = 0.0;
  double y_squares_ = 0.0;
};

/// σ0 is the slope of torque over displacement at the centre of the loop. Both are fitted against the
/// command, which has no noise, with a separate offset for each branch, so that the loop's width does not
/// affect the slope:
///   σ0 = (dτ/dc) / (dx/dc)
/// once with the commanded torque (dτ/dc = 1) and once with the measured one. dx/dc is fitted at the edges of
/// the encoder's steps, where the position is known exactly however coarse they are: a step in the middle of
/// the loop is 6e-5 rad, a third of its height. Edges of all cycles at about one torque are one point, as
/// they are the same edges again. The intervals are those of the scatter of these points, of the cycle in
/// which an edge appeared, and of the measured torque. If the motor delivers a constant offset instead of
/// small commands, the two differ, which shows that the loop is invalid (thesis, figure 20).
class Dahl final : public JointExperiment {
 public:
  /// `encoder_step_rad`: one tick at the joint. @throws std::invalid_argument unless it is positive.
  Dahl(const DahlConfig& config, double encoder_step_rad);

  RecordedCommands recorded_commands() const noexcept override { return {.torque = true}; }
  int measurement_count() const noexcept override { return config_.repeats; }
  double duration_s(int measurement) const noexcept override;
  void begin(int measurement, const Reading& reading) noexcept override;
  SetPoint step(const Reading& reading) noexcept override;
  bool finished() const noexcept override { return finished_; }
  std::span<const char* const> result_columns() const noexcept override;
  void write_result(std::span<double> values) const noexcept override;
  std::string not_measured(std::size_t column) const override;

 private:
  /// Edges of encoder steps at about one torque.
  struct Edges {
    double count = 0;
    double command_Nm = 0;        // mean
    double displacement_rad = 0;  // mean
  };
  static constexpr std::size_t kBins = 16;  // of torque, over the centre of the loop
  struct Branch {
    std::array<Edges, kBins> edges{};
    SlopeFit torque;
  };
  /// Displacement over torque, with half its 95 % interval; NaN if it is not known.
  struct Slope {
    double value = kUnknown;
    double ci95 = kUnknown;
  };
  Slope compliance() const noexcept;  // rad/(N·m)
  Slope delivered() const noexcept;   // measured over commanded torque
  void add_edge(Branch& branch, double command_Nm, double displacement_rad) noexcept;

  DahlConfig config_;
  double encoder_step_rad_;
  std::array<Branch, 2> branches_;  // torque rising, falling
  double origin_rad_ = 0.0;
  double before_rad_ = 0.0;
  double before_Nm_ = 0.0;
  double command_step_Nm_ = 0.0;  // largest from one cycle to the next: an edge was at any torque within
  double lowest_rad_ = 0.0;
  double highest_rad_ = 0.0;
  bool finished_ = false;
};

}  // namespace identification::experiments
