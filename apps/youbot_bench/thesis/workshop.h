/// @file
/// Where the figures are made: the thesis' robot, and the experiments on it.
#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "apps/youbot_bench/experiment_data.h"
#include "apps/youbot_bench/experiment_request.h"
#include "model/effects/drive_model.h"

namespace youbot_bench::thesis {

/// Thrown through the work when the program is asked to end.
struct Stopped {};

/// The four wheels of a simulated robot.
struct Wheels {
  std::string name;  ///< also of the folder of its models
  std::array<model::effects::DriveModel, 4> models{};
};

/// Runs experiments in virtual time and keeps in its directory what they record. One thread.
class Workshop {
 public:
  /// Writes the models of the thesis' robot. `show(stage)` is called before each piece of work.
  /// @throws hal::SetupError if the directory cannot be written.
  Workshop(std::filesystem::path directory, std::function<void(const std::string& stage)> show);

  const std::filesystem::path& directory() const noexcept { return directory_; }

  /// Measured curves, contact of 250 N·m/rad, 0.03 N·m offset, current without sign: apps/youbot_sim/thesis.
  const Wheels& thesis_robot() const noexcept { return thesis_robot_; }
  /// The same with motors that deliver what is asked for, and a current with sign.
  Wheels robot_without_offset() const;
  /// Such wheels with the friction of a law of model/friction in place of the measured curves; the laws'
  /// defaults are table 4.
  Wheels robot_with_law(const std::string& law) const;

  /// Before a piece of work. @throws Stopped.
  void begin(const std::string& stage) const;
  /// During one. @throws Stopped.
  static void go_on();
  /// Runs an experiment on these wheels, lifted, and reads what it recorded, which stays in the directory
  /// `figure`, a name such as "figure-18". `joints`: empty for all wheels.
  /// @throws Stopped; std::runtime_error if a fault stopped it.
  MeasuredExperiment measure(const std::string& figure, const Wheels& wheels,
                             const ExperimentParameters& parameters, const std::string& joints = {},
                             bool with_rows = true) const;

 private:
  std::filesystem::path directory_;
  std::function<void(const std::string&)> show_;
  Wheels thesis_robot_;
};

}  // namespace youbot_bench::thesis
