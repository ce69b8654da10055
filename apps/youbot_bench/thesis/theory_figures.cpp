// Figures 3 to 13: the friction laws that the thesis describes, with the values of its table 4 and 2.5.2.
#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "apps/youbot_bench/thesis/chapters.h"
#include "apps/youbot_bench/thesis/law_sweep.h"
#include "model/friction/any_law.h"
#include "runtime/program/wording.h"

namespace youbot_bench::thesis {
namespace {

using model::friction::AnyLaw;
using model::friction::make_law;
using report::Plot;
using report::Series;
using report::Style;

const report::Axis kDisplacementAxis{"displacement", "rad"};
const report::Axis kFrictionAxis{"friction torque", "N·m"};
const report::Axis kVelocityAxis{"velocity", "rad/s"};
constexpr double kSlow_rad_per_s = 1e-3;
constexpr double kStep_s = 2e-3;

Series steady_curve(const std::string& name, const AnyLaw& law, double from, double to, double step) {
  Series series{.name = name, .x = {}, .y = {}};
  const auto steps = static_cast<int>(std::lround((to - from) / step));
  for (int n = 0; n <= steps; ++n) {
    const double velocity = from + n * step;
    series.x.push_back(velocity);
    series.y.push_back(law.steady_Nm(velocity));
  }
  return series;
}

Series torque_over_way(const std::string& name, const LawSweep& swept) {
  return {.name = name, .x = swept.position_rad, .y = swept.torque_Nm};
}

Figure regimes() {
  Figure figure{
      .number = "Figure 3",
      .caption = "Pre-sliding, break-away and sliding, at three rates",
      .text = fmt::format(
          "LuGre's law with the values of table 4, σ0 = {:g} N·m/rad and σ1 = {:g} N·m·s/rad, from rest with "
          "three accelerations: the faster, the lower the break-away. The thesis' figure is another "
          "author's, "
          "in arbitrary units: nothing to compare.",
          printed_value("ramp/stiffness"), printed_value("ramp/damping"))};
  Plot plot{.title = "Friction over displacement", .x = kDisplacementAxis, .y = kFrictionAxis, .series = {}};
  constexpr double kWay_rad = 0.01;
  for (const double acceleration : {0.1, 1.0, 10.0}) {
    const double duration_s = std::sqrt(2 * kWay_rad / acceleration);
    plot.series.push_back(
        torque_over_way(runtime::number_text(acceleration, "rad/s²"),
                        sweep(
                            make_law("lugre"), [&](double t) { return acceleration * t * t / 2; }, duration_s,
                            duration_s / 2000)));
  }
  figure.plots = {plot};
  return figure;
}

/// Out, back, a little out again, and back past the point where it left for the inner loop.
constexpr std::array<double, 6> kInnerLoop_rad{0, 3e-4, 0, 1.5e-4, -1.5e-4, 1e-4};

/// How far the torque is off when the joint comes back to the point where it left for the inner loop.
double missed_Nm(const LawSweep& swept) {
  const std::vector<double>& x = swept.position_rad;
  std::vector<double> there_Nm;  // torque at each pass downwards through the point
  for (std::size_t i = 1; i < x.size(); ++i)
    if (x[i] <= kInnerLoop_rad[2] + 1e-9 && x[i - 1] > kInnerLoop_rad[2] + 1e-9)
      there_Nm.push_back(swept.torque_Nm[i]);
  return there_Nm.size() < 2 ? std::nan("") : std::abs(there_Nm[1] - there_Nm[0]);
}

Figure hysteresis() {
  Figure figure{
      .number = "Figure 4",
      .caption = "Pre-sliding hysteresis with an inner loop and non-local memory",
      .text =
          "The generalised Maxwell-slip law with its default elements. After the inner loop it goes on "
          "where it left the outer one."};
  const LawSweep swept = through(make_law("gms"), kInnerLoop_rad, kSlow_rad_per_s, kStep_s);
  figure.plots = {{.title = "Path",
                   .x = {"time", "s"},
                   .y = kDisplacementAxis,
                   .series = {{"displacement", swept.time_s, swept.position_rad}}},
                  {.title = "Friction over displacement",
                   .x = kDisplacementAxis,
                   .y = kFrictionAxis,
                   .series = {torque_over_way("gms", swept)}}};
  return figure;
}

Figure stribeck() {
  const AnyLaw law = make_law("kfm");
  Figure figure{
      .number = "Figures 6 and 8",
      .caption = "The Stribeck curve, and the regimes of a lubricated contact on it",
      .text =
          "The kinetic friction model with table 4. The borders between the regimes are no numbers of the "
          "thesis; ours are the Stribeck velocity and three times it."};
  Plot plot{.title = "Friction over velocity",
            .x = kVelocityAxis,
            .y = kFrictionAxis,
            .series = {steady_curve("kfm", law, 0.001, 1.0, 0.001)}};
  const double stribeck_rad_per_s = law.parameter("stribeck_velocity_rad_per_s");
  plot.spans = {{"II boundary", 0, stribeck_rad_per_s},
                {"III partial film", stribeck_rad_per_s, 3 * stribeck_rad_per_s},
                {"IV full film", 3 * stribeck_rad_per_s, 1.0}};
  plot.note = "Regime I, static friction, is at velocity zero.";
  figure.plots = {plot};
  return figure;
}

Figure frictional_lag() {
  Figure figure{
      .number = "Figure 7",
      .caption = "Frictional lag: friction follows a changing velocity late",
      .text =
          "LuGre's law with table 4, at velocities that swing about 0.16 rad/s. The faster they change, "
          "the further friction leaves the Stribeck curve."};
  constexpr double kMean_rad_per_s = 0.16;
  constexpr double kSwing_rad_per_s = 0.14;
  Plot plot{.title = "Friction over velocity", .x = kVelocityAxis, .y = kFrictionAxis, .series = {}};
  for (const double frequency_Hz : {1.0, 5.0, 20.0}) {
    const double rate = 2 * std::numbers::pi * frequency_Hz;
    LawSweep swept = sweep(
        make_law("lugre"),
        [&](double t) { return kMean_rad_per_s * t - kSwing_rad_per_s / rate * std::cos(rate * t); },
        3 / frequency_Hz, 1e-3 / frequency_Hz);
    const auto settled = static_cast<std::ptrdiff_t>(swept.torque_Nm.size() / 3 * 2);
    plot.series.push_back({.name = runtime::number_text(frequency_Hz, "Hz"),
                           .x = {swept.velocity_rad_per_s.begin() + settled, swept.velocity_rad_per_s.end()},
                           .y = {swept.torque_Nm.begin() + settled, swept.torque_Nm.end()}});
  }
  Series curve = steady_curve("steady", make_law("lugre"), 0.02, 0.3, 0.002);
  curve.style = Style::kDashed;
  plot.series.push_back(curve);
  figure.plots = {plot};
  return figure;
}

Figure static_models() {
  Figure figure{
      .number = "Figure 9",
      .caption = "Four static laws, each with one effect more",
      .text =
          "Coulomb; with viscous friction; with stiction; with the Stribeck curve (the kinetic friction "
          "model). Values of table 4."};
  Plot plot{.title = "Friction over velocity", .x = kVelocityAxis, .y = kFrictionAxis, .series = {}};
  for (const char* const law : {"coulomb", "viscous", "stiction", "kfm"})
    plot.series.push_back(steady_curve(law, make_law(law), -1.0, 1.0, 0.0025));
  figure.plots = {plot};
  return figure;
}

Figure threshold() {
  Figure figure{
      .number = "Figure 10",
      .caption = "A steep line below a small threshold in place of the jump at zero",
      .text = "Threshold 0.02 rad/s. Such a law cannot stick: below its break-away the joint creeps."};
  figure.plots = {
      {.title = "Friction over velocity",
       .x = kVelocityAxis,
       .y = kFrictionAxis,
       .series = {steady_curve("with threshold", make_law("regularised", {{"threshold_rad_per_s", 0.02}}),
                               -0.1, 0.1, 0.0005),
                  steady_curve("with jump", make_law("kfm"), -0.1, 0.1, 0.0005)}}};
  return figure;
}

Figure dahl_law() {
  Figure figure{.number = "Figure 11",
                .caption = "Friction over displacement by Dahl's law",
                .text = fmt::format("Fc = {:g} N·m and σ0 = {:g} N·m/rad; the exponent α shapes the bend.",
                                    printed_value("table 4/Fc"), printed_value("ramp/stiffness"))};
  Plot plot{.title = "Friction over displacement", .x = kDisplacementAxis, .y = kFrictionAxis, .series = {}};
  constexpr std::array<double, 4> kThereAndBack_rad{0, 1e-3, -1e-3, 1e-3};
  for (const double exponent : {0.5, 1.0, 2.0}) {
    const AnyLaw law = make_law("dahl", {{"exponent", exponent}});
    const LawSweep swept = through(law, kThereAndBack_rad, kSlow_rad_per_s, kStep_s);
    plot.series.push_back(torque_over_way("α = " + runtime::number_text(exponent), swept));
  }
  figure.plots = {plot};
  return figure;
}

Figure reversal_memory() {
  const LawSweep lugre = through(make_law("lugre"), kInnerLoop_rad, kSlow_rad_per_s, kStep_s);
  const LawSweep gms = through(make_law("gms"), kInnerLoop_rad, kSlow_rad_per_s, kStep_s);
  Figure figure{.number = "Figure 12",
                .caption = "LuGre does not find the point again where it left for an inner loop",
                .text = "The path of figure 4. The generalised Maxwell-slip law misses that point by " +
                        runtime::number_text(missed_Nm(gms), "N·m") + ", LuGre by " +
                        runtime::number_text(missed_Nm(lugre), "N·m") +
                        ". The thesis shows it on another author's path, without numbers."};
  figure.compared = {compare("lugre/loop", missed_Nm(lugre))};
  figure.plots = {{.title = "Friction over displacement",
                   .x = kDisplacementAxis,
                   .y = kFrictionAxis,
                   .series = {torque_over_way("lugre", lugre), torque_over_way("gms", gms)}}};
  return figure;
}

Figure maxwell_slip() {
  constexpr std::array<double, 2> kOut_rad{0, 2e-3};
  Figure figure{
      .number = "Figure 13",
      .caption = "The Maxwell-slip model: springs in parallel that slip one after the other",
      .text =
          "The figure of the thesis is a drawing of the elements; ours is the curve that four of them "
          "make: each bend is one that begins to slip."};
  figure.plots = {
      {.title = "Friction over the first displacement",
       .x = kDisplacementAxis,
       .y = kFrictionAxis,
       .series = {torque_over_way("gms", through(make_law("gms"), kOut_rad, kSlow_rad_per_s, kStep_s))}}};
  return figure;
}

}  // namespace

std::vector<Figure> theory(const Workshop& workshop) {
  workshop.begin("friction laws");
  return {regimes(),   hysteresis(), stribeck(),        frictional_lag(), static_models(),
          threshold(), dahl_law(),   reversal_memory(), maxwell_slip()};
}

}  // namespace youbot_bench::thesis
