/// @file
/// What the search for a wrong part knows about a robot, be it an arm or a base.
#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "identification/gap/regression.h"

namespace identification::robot_gap {

/// A parameter that may be wrong; predictions change with it nearly in proportion.
struct Term {
  std::string name;       ///< "mass_kg", in files and reports
  double given = 0;       ///< in the given model
  gap::Bounds change{};   ///< allowed changes of the value
  bool is_linear = true;  ///< predictions are a sum over such terms: one fit finds them
};

/// An effect of a part. Variants are alternatives of which the better one counts.
struct Candidate {
  std::string effect;              ///< "coulomb", as in gap.json
  int part = -1;                   ///< joint, link or wheel, from 0; −1: the whole robot
  std::string part_name;           ///< "joint2", "tip", "base"
  std::vector<std::size_t> terms;  ///< among the catalogue's
  bool is_refit = false;           ///< friction that the given model has
  bool same_effect(const Candidate& other) const {
    return effect == other.effect && part == other.part && part_name == other.part_name;
  }
};

struct Catalogue {
  std::vector<Term> terms;
  std::vector<Candidate> candidates;  ///< simple ones first
};

/// What is compared: the torque of a joint, a component of a displacement.
struct Channel {
  std::string name;
  std::string unit;  ///< "N·m"
};

/// A row is one channel at one time. Rows are in order of blocks; each block is a stretch of one recording.
struct RowPlan {
  struct Row {
    std::size_t motion = 0;
    Eigen::Index channel = 0;
    std::size_t at = 0;  ///< of the motion's rows, or windows
  };
  std::vector<Row> rows;
  std::vector<int> block;                 ///< of each row
  std::vector<std::size_t> block_motion;  ///< of each block
  int blocks() const noexcept { return static_cast<int>(block_motion.size()); }
};

struct ComparedRows {
  Eigen::VectorXd measured;  ///< in the unit of each row's channel
  Eigen::VectorXd predicted;
  Eigen::MatrixXd columns;  ///< derivative of the prediction by each term, then by the delay [1/s]
};

/// A model: the changes of all terms from the given one, and the delay of the measured quantity.
struct Fitted {
  Eigen::VectorXd changes;
  double delay_s = 0;
};

/// Recordings that are searched, or those that judge.
enum class Part : std::uint8_t { kSearched, kHeldOut };

/// Value of one quantity in a row, by which the disagreement is laid out.
struct Coordinate {
  std::string_view name;      ///< "speed"
  std::string_view unit;      ///< "rad/s"
  Eigen::Index channel = -1;  ///< −1: of all channels
  double value = 0;
  std::size_t bins = 6;
};

/// A robot with its recordings. Functions are thread-safe.
class Subject {
 public:
  Subject() = default;
  Subject(const Subject&) = delete;
  Subject& operator=(const Subject&) = delete;
  virtual ~Subject() = default;

  const Catalogue& catalogue() const noexcept { return catalogue_; }
  const std::vector<Channel>& channels() const noexcept { return channels_; }
  /// Rms of each channel's residual that the sensors' noise leaves.
  const Eigen::VectorXd& noise_floor() const noexcept { return floor_; }
  const RowPlan& plan(Part part) const noexcept { return part == Part::kSearched ? searched_ : held_out_; }
  /// Names of the recordings, as `motion` of a row counts them.
  const std::vector<std::string>& motions(Part part) const noexcept {
    return part == Part::kSearched ? searched_names_ : held_out_names_;
  }
  double longest_delay_s() const noexcept { return longest_delay_s_; }

  /// Whether predictions change in proportion to the delay: one fit finds it.
  bool has_linear_delay() const noexcept { return has_linear_delay_; }

  /// Predictions of a model. Columns of `terms`, then of the delay.
  virtual ComparedRows compare(Part part, const Fitted& at, std::span<const std::size_t> terms) const = 0;
  /// Of a row of the plan, beside its channel and recording.
  virtual std::vector<Coordinate> coordinates(Part part, std::size_t row) const = 0;
  virtual double time_s(Part part, std::size_t row) const = 0;
  /// Square of what the errors of a model add up to over whole recordings; 0 where they do not add up.
  virtual double accumulated(Part /*part*/, const Fitted& /*at*/) const { return 0; }
  /// The motion in which two sets of changes differ most, in words.
  virtual std::string deciding_experiment(const Eigen::VectorXd& one, const Eigen::VectorXd& other,
                                          std::uint64_t seed) const = 0;

 protected:
  Catalogue catalogue_;
  std::vector<Channel> channels_;
  Eigen::VectorXd floor_;
  RowPlan searched_;
  RowPlan held_out_;
  std::vector<std::string> searched_names_;
  std::vector<std::string> held_out_names_;
  double longest_delay_s_ = 0;
  bool has_linear_delay_ = false;
};

}  // namespace identification::robot_gap
