/// @file
/// A base on wheels with its recordings, for the search for a wrong part.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "control/base_description.h"
#include "identification/robot_gap/base_efforts.h"
#include "identification/robot_gap/base_motion.h"
#include "identification/robot_gap/base_noise.h"
#include "identification/robot_gap/base_terms.h"
#include "identification/robot_gap/subject.h"

namespace identification::robot_gap {

/// What is compared is the displacement over windows, in the axes of the tracked body at the start of each:
/// channels "forward" and "sideways" [m], "heading" [rad]. Headings have windows of their own, longer ones if
/// that shows more: a place after a long way shows the errors of the heading again. Rows count windows in
/// which the base moves. Where the description has a mass and every recording the torques of all wheels, the
/// forces on the base are compared, too: channels "force forward", "force sideways" [N] and "moment" [N·m].
class BaseSubject final : public Subject {
 public:
  /// Without `held_out` a quarter of each recording is set aside. `window_s`: 0: from the data.
  /// @throws std::invalid_argument naming the recording if the data cannot answer the question.
  BaseSubject(const control::BaseDescription& given, std::vector<BaseRecording> data,
              std::vector<BaseRecording> held_out, double window_s = 0);

  ComparedRows compare(Part part, const Fitted& at, std::span<const std::size_t> terms) const override;
  std::vector<Coordinate> coordinates(Part part, std::size_t row) const override;
  double time_s(Part part, std::size_t row) const override;
  /// Of the paths of whole runs [m²].
  double accumulated(Part part, const Fitted& at) const override;
  std::string deciding_experiment(const Eigen::VectorXd& one, const Eigen::VectorXd& other,
                                  std::uint64_t seed) const override;

  /// The given description with changes of every term.
  control::BaseDescription changed(const Eigen::VectorXd& changes) const;
  /// Of forward and sideways.
  double place_window_s() const noexcept { return window_s_[kPlace]; }
  double heading_window_s() const noexcept { return window_s_[kHeading]; }
  /// Delay of the poses behind the wheels from which those of Fitted count.
  double assumed_delay_s() const noexcept { return delay_s_; }
  /// Windows of the torques and their lag; null where forces are not compared.
  const BaseEfforts* efforts() const noexcept { return efforts_ ? &*efforts_ : nullptr; }
  /// What was cut or left out, in words.
  const std::vector<std::string>& notes() const noexcept { return notes_; }

  /// How far the path of a run, predicted from its first pose, is from the measured one. A jump of the pose
  /// begins another.
  struct PathError {
    std::string recording;
    double run = 0;       ///< of the column; 0 without
    double length_m = 0;  ///< of the measured path
    double rms_m = 0;     ///< over the run
    double end_m = 0;
    double end_heading_rad = 0;  ///< predicted minus measured
  };
  std::vector<PathError> path_errors(Part part, const Fitted& at) const;

 private:
  struct PlannedWindow {
    BaseWindow window;
    /// With a shorter delay than the one found, that one, and a longer one.
    std::array<WheelSteps, 3> wheels;
  };
  enum Compared : std::size_t { kPlace, kHeading, kEffort };
  using Windows = std::vector<std::vector<PlannedWindow>>;  // of each motion
  struct Side {
    std::vector<BaseMotion> motions;
    std::array<Windows, 2> windows;
  };

  static Compared compared_of(Eigen::Index channel) noexcept {
    return channel < 2 ? kPlace : channel == 2 ? kHeading : kEffort;
  }
  const EffortWindow* effort_of(Part part, std::size_t row) const noexcept {
    const RowPlan::Row& at = plan(part).rows[row];
    return compared_of(at.channel) == kEffort ? &efforts_->windows(part)[at.motion][at.at] : nullptr;
  }
  /// Of a row of place or heading.
  const BaseWindow& window_of(Part part, std::size_t row) const noexcept {
    const RowPlan::Row& at = plan(part).rows[row];
    return side(part).windows[compared_of(at.channel)][at.motion][at.at].window;
  }
  const Side& side(Part part) const noexcept { return part == Part::kSearched ? data_ : held_; }
  void see_speeds();
  double chosen_window_s(Compared what, double wanted_s);
  Windows planned(const std::vector<BaseMotion>& motions, double window_s) const;
  double information_in(const std::vector<BaseMotion>& motions, const Windows& windows, Compared what) const;
  BaseScatter scatter_in(const std::vector<BaseMotion>& motions, const Windows& windows) const;
  void leave_out_outliers(Side& side, Compared what);
  void find_floor(std::span<const BaseRecording> recordings);
  void plan_rows(Part part, RowPlan& plan) const;
  void list_terms(std::span<const BaseRecording> recordings);
  void compare_efforts(std::span<const BaseRecording> data, std::span<const BaseRecording> held_out);
  /// Of the tracked body in each window, predicted. `delay`: of PlannedWindow::wheels.
  Eigen::MatrixX3d displacements(const std::vector<BaseMotion>& motions, const Windows& windows,
                                 const control::BaseDescription& base, std::size_t delay) const;
  /// Derivative of them by a term.
  Eigen::MatrixX3d slope(const std::vector<BaseMotion>& motions, const Windows& windows,
                         const Eigen::VectorXd& changes, std::size_t term) const;
  /// The rows of the plan. `of`: displacements in these windows; `of_efforts`: forces in those of torques.
  template <class Of, class OfEfforts>
  Eigen::VectorXd in_rows(Part part, Of of, OfEfforts of_efforts) const;

  control::BaseDescription given_;
  BaseCatalogue terms_;
  Side data_;
  Side held_;
  double delay_s_ = 0;
  std::array<double, 2> window_s_{};
  double rest_m_per_s_ = 0;   ///< wheels below this speed stand still
  double speed_m_per_s_ = 0;  ///< typical
  double turn_rad_per_s_ = 0;
  double moving_s_ = 0;
  std::optional<BaseEfforts> efforts_;
  std::vector<Eigen::Index> axes_;  ///< of the efforts, of each channel from the fourth
  std::vector<double> load_;        ///< typical, of each wheel; empty: not measured
  std::vector<std::string> notes_;
};

}  // namespace identification::robot_gap
