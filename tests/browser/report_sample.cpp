// Writes the page that report_test.mjs checks: report_sample FILE
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "report/report.h"

namespace {

using report::Series;
using report::Style;
using std::numbers::pi;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Steady-state torque over velocity, in both directions, with the gap that no drive can measure at rest.
report::Plot friction_curve() {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 0.002);
  const auto torque = [](double v) {
    return std::copysign(0.045 + 0.035 * std::exp(-v * v / 0.04), v) + 0.0125 * v;
  };
  Series measured{.name = "measured, ±1 σ", .x = {}, .y = {}, .style = Style::kPoints};
  Series fitted{.name = "fitted, 95 %", .x = {}, .y = {}};
  for (int i = -20; i <= 20; ++i) {
    const double v = 0.1 * i;
    const double y = i == 0 ? kNone : torque(v) + noise(random);
    measured.x.push_back(v);
    measured.y.push_back(y);
    measured.lower.push_back(y - 0.004);
    measured.upper.push_back(y + 0.004);
  }
  for (int i = -200; i <= 200; ++i) {
    const double v = 0.01 * i;
    const double y = i == 0 ? kNone : torque(v);
    fitted.x.push_back(v);
    fitted.y.push_back(y);
    fitted.lower.push_back(y - 0.003 - 0.002 * std::abs(v));
    fitted.upper.push_back(y + 0.003 + 0.002 * std::abs(v));
  }
  return {.title = "Friction curve",
          .x = {"velocity", "rad/s"},
          .y = {"torque", "N·m"},
          .series = {measured,
                     fitted,
                     {"Coulomb only", {-2, 0, 0, 2}, {-0.055, -0.055, 0.055, 0.055}, Style::kDashed}},
          .note = "Torque falls until 0.3 rad/s and rises with speed from there."};
}

/// Torque over displacement: each x has two torques, so it is no function of x.
report::Plot loop() {
  Series hysteresis{.name = "pre-sliding", .x = {}, .y = {}};
  for (int i = 0; i <= 400; ++i) {
    const double phase = 2 * pi * i / 400;
    hysteresis.x.push_back(0.01 * std::cos(phase));
    hysteresis.y.push_back(0.06 * std::cos(phase - 0.6));
  }
  return {.title = "Pre-sliding loop",
          .x = {"displacement", "rad"},
          .y = {"torque", "N·m"},
          .series = {hysteresis}};
}

report::Plot log_axes() {
  Series response{.name = "response", .x = {}, .y = {}, .style = Style::kLineAndPoints};
  for (int i = 0; i <= 16; ++i) {
    const double frequency = std::pow(10, -1 + 0.25 * i);
    response.x.push_back(frequency);
    response.y.push_back(1 / std::hypot(1, frequency / 10));
  }
  response.x.insert(response.x.begin(), 0);  // has no place on this axis
  response.y.insert(response.y.begin(), 1);
  return {.title = "Frequency response",
          .x = {.label = "frequency", .unit = "Hz", .log = true},
          .y = {.label = "gain", .log = true},
          .series = {response}};
}

/// A million points, two of which are outliers that must survive.
report::Plot large() {
  Series noise{.name = "", .x = {}, .y = {}};
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 1'000'000; ++i) {
    noise.x.push_back(0.001 * i);
    noise.y.push_back(uniform(random) * 1e-5);
  }
  noise.y[250'000] = 5e-5;
  noise.y[750'000] = -5e-5;
  return {.title = "Residual", .x = {"time", "s"}, .y = {"torque", "N·m"}, .series = {noise}};
}

report::Plot steps() {
  return {.title = "</script><b>Escaped & \"quoted\"</b>",
          .x = {.label = "time", .unit = "s", .from = 0, .to = 4},
          .y = {.label = "position", .unit = "rad", .from = -1, .to = 3},
          .series = {{"with gap", {0, 1, 2, 3, 4}, {0, 2, kNone, 2, 0}},
                     {.name = "expected", .x = {0, 4}, .y = {}, .lower = {-0.5, -0.5}, .upper = {0.5, 0.5}}}};
}

report::Plot many_series() {
  report::Plot plot{
      .title = "Seven models", .x = {"velocity", "rad/s"}, .y = {"torque", "N·m"}, .series = {}};
  for (int n = 0; n < 7; ++n) {
    Series one{.name = "model " + std::to_string(n + 1),
               .x = {},
               .y = {},
               .style = n % 2 == 0 ? Style::kLine : Style::kLineAndPoints};
    for (int i = 0; i <= 12; ++i) {
      one.x.push_back(i);
      one.y.push_back(1000.0 * n + 200 * std::sin(0.5 * i + n));
    }
    plot.series.push_back(one);
  }
  return plot;
}

/// Three plots of one run: a ramp and its double, two equal lines, one line. The phases are marked, and a
/// fault.
std::vector<report::Plot> linked() {
  const report::Axis time{.label = "time", .unit = "s", .link = "time"};
  const std::vector<report::Span> spans{
      {"starting", 0, 2}, {"running", 2, 8}, {"stopping", 8, 10}, {"fault", 8, 8}};
  const std::vector<double> ends{0, 10};
  return {{.title = "Ramps",
           .x = time,
           .y = {"force", "N"},
           .series = {{"single", ends, {0, 10}}, {"double", ends, {0, 20}}},
           .spans = spans},
          {.title = "Equal lines",
           .x = time,
           .y = {"torque", "N·m"},
           .series = {{"wheel-1", ends, {1, 3}}, {"wheel-2", ends, {1, 3}}},
           .spans = spans},
          {.title = "Half of the time",
           .x = time,
           .y = {"speed", "m/s"},
           .series = {{"robot", {0, 5}, {1e-7, 6e-7}}}}};
}

/// Wider than high, in a plot that is wider still.
report::Plot circle() {
  Series path{.name = "path", .x = {}, .y = {}};
  for (int i = 0; i <= 100; ++i) {
    path.x.push_back(0.4 * std::cos(2 * pi * i / 100));
    path.y.push_back(0.4 * std::sin(2 * pi * i / 100));
  }
  return {.title = "Circle",
          .x = {"x", "m"},
          .y = {"y", "m"},
          .series = {{"line", {-1, 1}, {-0.5, -0.5}}, path},
          .equal_axes = true};
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 2) throw std::runtime_error("usage: report_sample FILE");
    report::Page page("Friction of wheel-1 <sample>");
    page.text("What a report can show.\n\nValues & units are text: <b>not bold</b>.");
    page.heading("Parameters");
    page.table({{"parameter"}, {"value"}, {"unit"}, {"95 % interval"}, {"samples"}},
               {{"Coulomb", 0.045, "N·m", "0.044 … 0.046", 40.0},
                {"viscous", 0.0125, "N·m·s/rad", "0.0121 … 0.0129", 40.0},
                {"Stribeck <velocity>", 0.2, "rad/s", "0.18 … 0.22", 12.0},
                {"bristle stiffness", kNone, "N·m/rad", "not seen in this data", 0.0}},
               "Identified parameters");
    page.table({{"model"}, {"rms residual", "mN·m", 2}},
               {{"none", 41.126}, {"Coulomb", 9.5}, {"Stribeck", 1.98}});
    page.heading("Curves");
    page.plot(friction_curve());
    page.plots({loop(), log_axes(), large(), steps()});
    page.plot(many_series());
    page.plots({{.title = "Nothing measured",
                 .x = {"time", "s"},
                 .y = {"torque", "N·m"},
                 .series = {{"none", {}, {}}}},
                {.title = "One point",
                 .x = {"time", "s"},
                 .y = {.label = "torque", .unit = "N·m", .log = true},
                 .series = {{"once", {3, 4}, {0.5, -1}, Style::kLine}}}});
    page.heading("Linked");
    page.table({{"file"}, {"unlike numbers"}},
               {{report::Link{"the <sample>", "report_sample.html"}, 0.00012}, {"none", 12345.678}});
    page.plots(linked());
    page.plot(circle());
    page.write(argv[1]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "report_sample: %s\n", error.what());
    return 1;
  }
}
