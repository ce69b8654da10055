#include "apps/youbot_bench/transparency_report.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "runtime/configuration/whole_file.h"
#include "runtime/program/build_info.h"
#include "runtime/program/wording.h"

namespace youbot_bench {
namespace {

namespace two_port = identification::two_port;
using two_port::HybridPoint;
using Results = std::vector<TransparencyResult>;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
/// Without feedback h12 is a rounding error.
constexpr double kNothing = 1e-9;
/// Frequencies at which impedances are reported, if measured.
constexpr std::array<double, 4> kReported_Hz{0.3, 1.0, 3.0, 10.0};
constexpr std::array<const char*, 3> kAxes{"forward", "left", "up"};

double least_coherence(const HybridPoint& point) { return *std::ranges::min_element(point.coherence); }

/// At the nearest valid point, at most a quarter of the frequency away.
double magnitude_near(const TransparencyResult& result, double frequency_Hz,
                      const std::function<std::complex<double>(const Eigen::Matrix2cd&)>& value) {
  constexpr double kFarthest = 0.25;
  double nearest = kFarthest;
  double magnitude = kUnknown;
  for (const HybridPoint& point : result.points) {
    const double distance = std::abs(std::log(point.frequency_Hz / frequency_Hz));
    if (!point.ok || distance >= nearest) continue;
    nearest = distance;
    magnitude = std::abs(value(point.H));
  }
  return magnitude;
}

std::complex<double> free_air(const Eigen::Matrix2cd& H) { return H(0, 0); }

/// One quantity for all conditions. NaN: unknown.
struct Figure {
  std::string name;
  std::string unit;
  std::vector<double> values;
};

class Figures {
 public:
  explicit Figures(const Results& results) : results_(results) {}

  void add(std::string name, std::string unit,
           const std::function<double(const TransparencyResult&)>& value) {
    Figure& figure = figures_.emplace_back(Figure{std::move(name), std::move(unit), {}});
    for (const TransparencyResult& result : results_) figure.values.push_back(value(result));
  }
  void add_measure(std::string name, std::string unit,
                   const std::function<double(const two_port::TwoPortMeasures&)>& value) {
    add(std::move(name), std::move(unit), [&value](const TransparencyResult& result) {
      return result.measures ? value(*result.measures) : kUnknown;
    });
  }
  std::vector<Figure> take() { return std::move(figures_); }

 private:
  const Results& results_;
  std::vector<Figure> figures_;
};

std::vector<Figure> figures_of(const Results& results) {
  using Measures = two_port::TwoPortMeasures;
  Figures figures(results);
  figures.add_measure("position tracking, low frequencies", "",
                      [](const Measures& m) { return m.position.low_frequency_gain; });
  figures.add_measure("  -3 dB bandwidth", "Hz",
                      [](const Measures& m) { return m.position.bandwidth_Hz.value_or(kUnknown); });
  figures.add_measure("force tracking, low frequencies", "",
                      [](const Measures& m) { return m.force.low_frequency_gain; });
  figures.add_measure("  -3 dB bandwidth", "Hz", [](const Measures& m) {
    return m.force.low_frequency_gain < kNothing ? kUnknown : m.force.bandwidth_Hz.value_or(kUnknown);
  });
  figures.add_measure("scaling product", "", [](const Measures& m) { return m.scaling_product; });
  for (const double frequency_Hz : kReported_Hz)
    figures.add(
        fmt::format("felt in free air at {:g} Hz", frequency_Hz), "N·s/m",
        [=](const TransparencyResult& result) { return magnitude_near(result, frequency_Hz, free_air); });
  for (const double frequency_Hz : kReported_Hz)
    figures.add(fmt::format("Z-width at {:g} Hz", frequency_Hz), "N·s/m",
                [=](const TransparencyResult& result) {
                  return magnitude_near(result, frequency_Hz, two_port::impedance_width);
                });
  const std::vector<two_port::PortEnvironment> environments = two_port::usual_environments();
  for (std::size_t i = 0; i < environments.size(); ++i)
    figures.add_measure(fmt::format("transparency error, {} ({:g} N/m)", environments[i].name,
                                    environments[i].stiffness_N_per_m),
                        "", [=](const Measures& m) { return m.environments[i].transparency_error; });
  for (std::size_t i = 0; i < environments.size(); ++i)
    figures.add_measure("fidelity, " + environments[i].name, "",
                        [=](const Measures& m) { return m.environments[i].fidelity; });
  figures.add_measure("stable with whatever is passive (Llewellyn)", "% of lines",
                      [](const Measures& m) { return 100 * m.stable_share; });
  figures.add("frequencies discarded", "", [](const TransparencyResult& result) {
    return static_cast<double>(std::ranges::count(result.points, false, &HybridPoint::ok));
  });
  figures.add("energy tank at work", "% of time",
              [](const TransparencyResult& result) { return 100 * result.passive_share; });
  figures.add("robot's force or torque limited", "% of time",
              [](const TransparencyResult& result) { return 100 * result.limited_share; });
  figures.add("outside, under rate control", "% of time",
              [](const TransparencyResult& result) { return 100 * result.rate_share; });
  figures.add("handle's displacement to one side", "mm",
              [](const TransparencyResult& result) { return 1e3 * result.furthest_pen_m; });
  figures.add("end effector's displacement to one side", "mm",
              [](const TransparencyResult& result) { return 1e3 * result.furthest_tip_m; });
  return figures.take();
}

std::string unit_text(const Figure& figure) { return figure.unit.empty() ? "" : " [" + figure.unit + "]"; }

/// A sentence on discarded points with the reason; empty if there are none.
std::string discarded_text(const TransparencyResult& result) {
  if (!result.fault.empty()) return "ended by a fault at " + result.fault;
  std::vector<double> discarded_Hz;
  for (const HybridPoint& point : result.points)
    if (!point.ok) discarded_Hz.push_back(point.frequency_Hz);
  if (discarded_Hz.empty()) return {};
  std::string text =
      fmt::format("{} of {} frequencies discarded, within {}: coherence below {:g}", discarded_Hz.size(),
                  result.points.size(), runtime::range_text(discarded_Hz, "Hz"),
                  two_port::EstimateLimits{}.lowest_coherence);
  if (!result.measures) text += "; too few are left for measures";
  return text;
}

std::string set_up_text(const TransparencyPlan& plan) {
  return fmt::format(
      "Along the end effector's direction {}, {} realizations of {:g} s, {:g} N at most; free, then with "
      "{:g} N/m at the end effector. Force scale {:g}, motion scale {:g}: ideal would be force tracking "
      "{:.3g}, "
      "position tracking {:.3g}; by the scales alone every transparency error is {:.2f}, every fidelity "
      "{:.3g}.",
      kAxes[static_cast<std::size_t>(plan.axis)], plan.realizations, plan.excitation.period_s,
      plan.excitation.peak_N, plan.tether_N_per_m, plan.control.feedback.force_scale,
      plan.control.mapping.motion_scale, 1 / plan.control.feedback.force_scale,
      plan.control.mapping.motion_scale,
      std::abs(std::log(plan.control.mapping.motion_scale / plan.control.feedback.force_scale)),
      plan.control.mapping.motion_scale / plan.control.feedback.force_scale);
}

const report::Axis kFrequency{.label = "frequency", .unit = "Hz", .log = true, .link = "frequency"};

/// Over frequency, for each condition; gaps at invalid points.
report::Plot over_frequency(const std::string& title, const report::Axis& y, const Results& results,
                            const std::function<double(const HybridPoint&)>& value) {
  report::Plot plot{.title = title, .x = kFrequency, .y = y, .series = {}};
  for (const TransparencyResult& result : results) {
    if (result.points.empty()) continue;
    report::Series series{
        .name = condition_text(result.condition), .x = {}, .y = {}, .style = report::Style::kLineAndPoints};
    for (const HybridPoint& point : result.points) {
      series.x.push_back(point.frequency_Hz);
      series.y.push_back(value(point));
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

/// Without jumps of a full turn from one point to the next.
report::Plot unwrapped(report::Plot phase_deg) {
  constexpr double kTurn_deg = 360;
  for (report::Series& series : phase_deg.series) {
    double last = 0;
    for (double& y : series.y) {
      if (!std::isfinite(y)) continue;
      y -= kTurn_deg * std::round((y - last) / kTurn_deg);
      last = y;
    }
  }
  return phase_deg;
}

/// A rounding error has no place in a logarithmic plot, and no phase.
void add_element(report::Page& page, const Results& results, const std::string& name, const std::string& unit,
                 Eigen::Index row, Eigen::Index column) {
  const auto shown = [=](const HybridPoint& point) {
    return point.ok && std::abs(point.H(row, column)) >= kNothing;
  };
  page.plots({over_frequency("|" + name + "|", {.label = "magnitude", .unit = unit, .log = true}, results,
                             [=](const HybridPoint& point) {
                               return shown(point) ? std::abs(point.H(row, column)) : kUnknown;
                             }),
              unwrapped(over_frequency("Phase of " + name, {.label = "phase", .unit = "°"}, results,
                                       [=](const HybridPoint& point) {
                                         return shown(point)
                                                    ? std::arg(point.H(row, column)) * 180 / std::numbers::pi
                                                    : kUnknown;
                                       }))});
}

report::Plot felt_plot(const TransparencyResult& result) {
  report::Plot plot{.title = condition_text(result.condition),
                    .x = kFrequency,
                    .y = {.label = "impedance", .unit = "N·s/m", .log = true},
                    .series = {}};
  unsigned look = 0;
  const auto add = [&](const std::string& name, report::Style style, auto&& value) {
    report::Series series{.name = name, .x = {}, .y = {}, .style = style, .look = look};
    for (const HybridPoint& point : result.points) {
      series.x.push_back(point.frequency_Hz);
      series.y.push_back(point.ok ? std::abs(value(point)) : kUnknown);
    }
    plot.series.push_back(std::move(series));
  };
  for (const two_port::PortEnvironment& environment : two_port::usual_environments()) {
    add(environment.name + ", felt", report::Style::kLine, [&](const HybridPoint& point) {
      return two_port::transmitted_impedance(point.H, environment.impedance_N_s_per_m(point.frequency_Hz));
    });
    add(environment.name, report::Style::kDashed,
        [&](const HybridPoint& point) { return environment.impedance_N_s_per_m(point.frequency_Hz); });
    ++look;
  }
  add("free air, felt", report::Style::kLine, [](const HybridPoint& point) { return free_air(point.H); });
  return plot;
}

std::string number(double value) {
  if (!std::isfinite(value)) return "-";
  return fmt::format("{:.3g}", std::abs(value) < kNothing ? 0.0 : value);
}

}  // namespace

std::string condition_text(const TransparencyCondition& condition) {
  return fmt::format("{}, {:g} N/m", name_of(condition.feedback), condition.stiffness_N_per_m);
}

void write_transparency_csv(const std::filesystem::path& directory, const TransparencyPlan& plan,
                            const TransparencyResult& result, const std::string& config) {
  const TransparencyCondition& condition = result.condition;
  const std::filesystem::path path =
      directory / fmt::format("{}-{:g}.csv", name_of(condition.feedback), condition.stiffness_N_per_m);
  const auto text = [](double value) { return fmt::format("{:g}", value); };
  std::string csv;
  const auto add = [&csv](const char* key, const std::string& value) {
    csv += fmt::format("# {}: {}\n", key, value);
  };
  add("experiment", "transparency");
  add("feedback", name_of(condition.feedback));
  add("stiffness_N_per_m", text(condition.stiffness_N_per_m));
  add("direction", kAxes[static_cast<std::size_t>(plan.axis)]);
  add("excitation_peak_N", text(plan.excitation.peak_N));
  add("period_s", text(plan.excitation.period_s));
  add("realizations", std::to_string(plan.realizations));
  add("tether_N_per_m", text(plan.tether_N_per_m));
  add("tether_N_s_per_m", text(plan.tether_N_s_per_m));
  add("force_scale", text(plan.control.feedback.force_scale));
  add("motion_scale", text(plan.control.mapping.motion_scale));
  add("configuration", config.empty() ? "defaults" : config);
  add("software", runtime::build_version());
  if (!result.fault.empty()) add("fault", result.fault);
  csv +=
      "frequency_Hz,h11_re_N_s_per_m,h11_im_N_s_per_m,h12_re,h12_im,h21_re,h21_im,h22_re_m_per_N_s,"
      "h22_im_m_per_N_s,coherence_hand_force,coherence_master_velocity,coherence_environment_force,"
      "coherence_slave_velocity,condition,ok\n";
  for (const HybridPoint& point : result.points) {
    csv += text(point.frequency_Hz);
    for (const Eigen::Index row : {0, 1})
      for (const Eigen::Index column : {0, 1}) {
        const std::complex<double> element = point.H(row, column);
        csv += fmt::format(",{:.9g},{:.9g}", element.real(), element.imag());
      }
    for (const double coherence : point.coherence) csv += fmt::format(",{:.6g}", coherence);
    csv += fmt::format(",{:.6g},{:d}\n", point.condition, point.ok);
  }
  runtime::write_whole_file(path, csv);
}

std::string transparency_text(const TransparencyPlan& plan, const Results& results) {
  constexpr int kName = 54;
  constexpr int kColumn = 17;
  std::string text = set_up_text(plan) + "\n\n" + fmt::format("{:<{}}", "feedback", kName);
  for (const TransparencyResult& result : results)
    text += fmt::format("{:>{}}", name_of(result.condition.feedback), kColumn);
  text += "\n" + fmt::format("{:<{}}", "coupling [N/m]", kName);
  for (const TransparencyResult& result : results)
    text += fmt::format("{:>{}g}", result.condition.stiffness_N_per_m, kColumn);
  text += "\n";
  for (const Figure& figure : figures_of(results)) {
    text += fmt::format("{:<{}}", figure.name + unit_text(figure), kName);
    for (const double value : figure.values) text += fmt::format("{:>{}}", number(value), kColumn);
    text += "\n";
  }
  for (const TransparencyResult& result : results)
    if (const std::string discarded = discarded_text(result); !discarded.empty())
      text += condition_text(result.condition) + ": " + discarded + "\n";
  return text;
}

report::Page transparency_page(const TransparencyPlan& plan, const Results& results) {
  report::Page page("Transparency of teleoperation");
  page.text(
      "Hand and end effector as the two ports of [F_h; -V_s] = H·[V_m; F_e]: force of the hand and velocity "
      "of the handle, force on the environment and velocity of the end effector, all in the simulation and "
      "in the robot's directions. h11 is what is felt in free air, h12 how much of the force on the end "
      "effector arrives at the hand, -h21 how the end effector follows, h22 how it yields to a force.");
  page.text(set_up_text(plan));
  std::string discarded;
  for (const TransparencyResult& result : results)
    if (const std::string text = discarded_text(result); !text.empty())
      discarded += condition_text(result.condition) + ": " + text + ".\n\n";
  std::vector<report::Column> columns{{"measure"}, {"unit"}};
  for (const TransparencyResult& result : results) columns.push_back({condition_text(result.condition)});
  std::vector<report::Row> rows;
  for (const Figure& figure : figures_of(results)) {
    report::Row row{figure.name, figure.unit};
    for (const double value : figure.values) row.emplace_back(number(value));
    rows.push_back(std::move(row));
  }
  page.table(columns, rows, "Measures");
  page.text(
      "A dash means not available; for a bandwidth, that the gain does not fall by 3 dB within the band.");
  if (!discarded.empty()) page.text(discarded);
  if (std::ranges::all_of(results, [](const TransparencyResult& r) { return r.points.empty(); })) return page;

  page.heading("The hybrid matrix");
  add_element(page, results, "h11", "N·s/m", 0, 0);
  add_element(page, results, "h12", "", 0, 1);
  add_element(page, results, "h21", "", 1, 0);
  add_element(page, results, "h22", "m/(N·s)", 1, 1);
  page.heading("What the hand feels of an environment");
  page.text(
      "Felt, and dashed what is there. Transparent would be as far apart at all frequencies as the scales "
      "ask for.");
  std::vector<report::Plot> felt;
  for (const TransparencyResult& result : results)
    if (!result.points.empty()) felt.push_back(felt_plot(result));
  page.plots(felt);
  page.heading("Reliability");
  report::Plot coherence = over_frequency(
      "Coherence", {.label = "least of the four signals", .from = 0, .to = 1}, results, least_coherence);
  coherence.note =
      "Below 0.9 a frequency is discarded: friction of joints and wheels, not the hand, then determines much "
      "of the measurement.";
  page.plots({std::move(coherence)});
  return page;
}

}  // namespace youbot_bench
