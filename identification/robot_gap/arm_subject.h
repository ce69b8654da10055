/// @file
/// A serial arm as a subject of the search: torques of its joints, by Newton and Euler.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "control/arm_description.h"
#include "identification/robot_gap/arm_motion.h"
#include "identification/robot_gap/arm_terms.h"
#include "identification/robot_gap/subject.h"

namespace identification::robot_gap {

struct ArmOptions {
  double band_Hz = 10;                    ///< up to which torques are compared
  std::vector<double> ripples_per_rev{};  ///< to try in a turn of each joint
};

class ArmSubject final : public Subject {
 public:
  /// Without `held_out` the last quarter of each recording is set aside; of recordings too short for that,
  /// one in four.
  /// @throws std::invalid_argument naming recording or joint if the data cannot answer the question.
  ArmSubject(const control::ArmDescription& arm, std::vector<ArmRecording> data,
             std::vector<ArmRecording> held_out, const ArmOptions& options);

  /// The arm with changes of its terms.
  control::ArmDescription changed(const Eigen::VectorXd& changes) const;
  double band_Hz() const noexcept { return band_Hz_; }

  ComparedRows compare(Part part, const Fitted& at, std::span<const std::size_t> terms) const override;
  std::vector<Coordinate> coordinates(Part part, std::size_t row) const override;
  double time_s(Part part, std::size_t row) const override;
  std::string deciding_experiment(const Eigen::VectorXd& one, const Eigen::VectorXd& other,
                                  std::uint64_t seed) const override;

 private:
  const std::vector<ArmMotion>& motions_of(Part part) const {
    return part == Part::kSearched ? searched_motions_ : held_out_motions_;
  }
  void require_motion() const;

  control::ArmDescription given_;
  double band_Hz_ = 0;
  std::vector<ArmTerm> terms_;
  std::vector<ArmMotion> searched_motions_;
  std::vector<ArmMotion> held_out_motions_;
  Eigen::VectorXd searched_load_Nm_;  // predicted with the given model, by row
  Eigen::VectorXd held_out_load_Nm_;
};

}  // namespace identification::robot_gap
