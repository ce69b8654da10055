#include "operation/base_page.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <vector>

#include "hal/seconds.h"
#include "operation/path_plot.h"
#include "operation/run_page.h"

namespace operation {
namespace {

using report::Style;

constexpr std::array<const char*, kWheels> kWheelNames{"wheel-1", "wheel-2", "wheel-3", "wheel-4"};

class BaseReport final : public RunReport<CycleRecord, Summary> {
 public:
  BaseReport(const Cycle::Config& config, std::string experiment)
      : config_(config), experiment_(std::move(experiment)), common_(config.period, limits()) {}

  void add(const CycleRecord& record) override {
    const std::array<double, 3>& pose = std::isfinite(record.truth_W[0]) ? record.truth_W : record.odometry_W;
    std::array<double, kChannels> values{};
    const auto put = [&values](std::size_t first, const auto& numbers) {
      std::copy(numbers.begin(), numbers.end(), values.begin() + static_cast<std::ptrdiff_t>(first));
    };
    put(kReference, record.reference_W);
    put(kPose, pose);
    values[kDistance] = std::hypot(record.reference_W[0] - pose[0], record.reference_W[1] - pose[1]);
    values[kTurn] = record.reference_W[2] - pose[2];
    put(kWrench, record.wrench_B);
    put(kCommand, record.torque_command_Nm);
    put(kMeasured, record.torque_measured_Nm);
    put(kVelocity, record.velocity_rad_per_s);
    put(kFactor, record.friction_factor);
    trace_.add(hal::seconds(record.time), values);
    reference_.add({record.reference_W[0], record.reference_W[1], 0});
    odometry_.add({record.odometry_W[0], record.odometry_W[1], 0});
    truth_.add({record.truth_W[0], record.truth_W[1], 0});

    for (std::size_t i = 0; i < kWheels; ++i)
      touched_[i] = is_at_limit(record.torque_command_Nm[i], config_.controller.torque_limit_Nm);
    common_.add(record.time, name(record.phase), record.limited, touched_, {record.wake_up, record.step});
  }

  report::Page page(const Summary& summary) const override {
    const PathMetrics& path = summary.path;
    report::Page page(fmt::format(
        "Base run ({}) of {:.1f} s: {:.1f} mm rms from the reference, {:.1f} mm at worst{}", experiment_,
        common_.duration_s(), 1e3 * path.rms_m(), 1e3 * path.worst_m(), RunPage::end_in_title(summary)));
    RunPage::add_end(page, summary);
    add_summary(page, summary);
    add_path(page);
    add_motion(page, summary);
    common_.add_rest(page, summary);
    return page;
  }

 private:
  /// Channels of the trace.
  enum Channel : std::size_t {
    kReference = 0,  // x, y, yaw
    kPose = 3,
    kDistance = 6,
    kTurn = 7,
    kWrench = 8,  // x, y, moment
    kCommand = 11,
    kMeasured = 15,
    kVelocity = 19,
    kFactor = 23,
    kChannels = 27,
  };

  static std::vector<RunPage::Limit> limits() {
    std::vector<RunPage::Limit> limits;
    for (const char* wheel : kWheelNames)
      limits.push_back({std::string(wheel) + " at its torque limit", /*only_if_touched=*/true});
    return limits;
  }

  void add_summary(report::Page& page, const Summary& summary) const {
    const PathMetrics& path = summary.path;
    page.heading("Summary");
    page.table(
        {{"what"}, {"value"}, {"how it is measured"}},
        {summary_row("robot", summary.robot, summary.virtual_time ? "in virtual time" : "in real time"),
         summary_row("friction compensation", config_.controller.compensate_friction ? "on" : "off",
                     "of the wheels"),
         summary_row(
             "first motion",
             path.first_motion() ? fmt::format("{:.2f} s", hal::seconds(*path.first_motion())) : "never",
             "after the drives began to obey"),
         summary_row("distance from the reference, rms", fmt::format("{:.1f} mm", 1e3 * path.rms_m()),
                     path.on_truth() ? "true pose of the simulation" : "odometry"),
         summary_row("at worst", fmt::format("{:.1f} mm", 1e3 * path.worst_m()),
                     "while it followed the reference"),
         summary_row("heading error at worst", fmt::format("{:.3f} rad", path.worst_rad()), "likewise"),
         summary_row("distance at the end", fmt::format("{:.1f} mm", 1e3 * path.final_m()),
                     "in the last cycle with a reference"),
         summary_row("heading error at the end", fmt::format("{:.3f} rad", path.final_rad()), "likewise")});
  }

  void add_path(report::Page& page) const {
    page.heading("Path");
    std::vector<report::Series> paths{odometry_.series("base, by odometry", 1, Style::kLine)};
    if (!truth_.empty()) paths.push_back(truth_.series("base, true", 1, Style::kLine));
    if (!reference_.empty()) paths.push_back(reference_.series("reference", 1, Style::kDashed));
    report::Plot plot = path_plot("From above", 1, std::move(paths));
    plot.note = "In the frame of the start: x forward, y to the left.";
    add_base_limits(plot, config_.workspace);
    page.plot(plot);
  }

  void add_motion(report::Page& page, const Summary& summary) const {
    const std::vector<report::Span> spans = common_.spans(summary);
    const auto plot = [&spans](const char* title, const report::Axis& y, std::vector<report::Series> series) {
      return over_time(title, y, std::move(series), spans);
    };
    const auto wheels = [this](std::size_t first) {
      std::vector<report::Series> series;
      for (std::size_t i = 0; i < kWheels; ++i) series.push_back(trace_.series(kWheelNames[i], first + i, 4));
      return series;
    };
    page.heading("Motion and forces");
    const auto& limits = config_.controller.wrench_limits;
    report::Plot force =
        plot("Force on the base, commanded", {"force", "N"},
             {trace_.series("forward", kWrench, 3), trace_.series("to the left", kWrench + 1, 3)});
    force.note = fmt::format("Before friction compensation; limited to {:g} N.", limits.force_N);
    report::Plot moment =
        plot("Moment on the base, commanded", {"moment", "N·m"}, {trace_.series("moment", kWrench + 2, 3)});
    moment.note = fmt::format("Before friction compensation; limited to {:g} N·m.", limits.moment_Nm);
    report::Plot torque = plot("Wheel torque, commanded", {"torque", "N·m"}, wheels(kCommand));
    torque.note =
        fmt::format("With friction compensation; limited to {:g} N·m.", config_.controller.torque_limit_Nm);
    report::Plot velocity = plot("Wheel velocity", {"velocity", "rad/s"}, wheels(kVelocity));
    velocity.note = fmt::format("More than {:g} rad/s stops the robot.", config_.wheel_speed_limit_rad_per_s);
    std::vector<report::Plot> plots(
        {plot("Position", {"position", "m"},
              {trace_.series("x", kPose, 4), trace_.series("y", kPose + 1, 4),
               trace_.series("x of the reference", kReference, 4, 1, Style::kDashed),
               trace_.series("y of the reference", kReference + 1, 4, 1, Style::kDashed)}),
         plot("Heading", {"heading", "rad"},
              {trace_.series("base", kPose + 2, 4),
               trace_.series("reference", kReference + 2, 4, 1, Style::kDashed)}),
         plot("Distance from the reference", {"distance", "mm"},
              {trace_.series("distance", kDistance, 2, 1e3)}),
         plot("Heading error", {"reference − base", "rad"}, {trace_.series("heading error", kTurn, 4)}),
         force, moment, torque, plot("Wheel torque, measured", {"torque", "N·m"}, wheels(kMeasured)),
         velocity});
    if (config_.controller.adapt) {
      plots.push_back(plot("Friction factor", {"factor"}, wheels(kFactor)));
      plots.back().note = "Of each wheel's model; the compensation uses it.";
    }
    page.plots(plots);
  }

  Cycle::Config config_;
  std::string experiment_;
  RunPage common_;
  TimeTrace trace_{kChannels};
  Track reference_;
  Track odometry_;
  Track truth_;
  std::vector<bool> touched_ = std::vector<bool>(kWheels);
};

}  // namespace

std::unique_ptr<RunReport<CycleRecord, Summary>> base_report(const Cycle::Config& config,
                                                             const std::string& experiment) {
  return std::make_unique<BaseReport>(config, experiment);
}

}  // namespace operation
