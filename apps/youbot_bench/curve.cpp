#include "apps/youbot_bench/curve.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "model/friction/wheel_curve.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/program/exit_code.h"

namespace youbot_bench {

void print_curve(const CurveOptions& options) {
  const double rows =
      std::floor((options.to_rad_per_s - options.from_rad_per_s) / options.step_rad_per_s + 1e-9);
  if (!(options.step_rad_per_s > 0 && rows >= 0 && rows <= 1e7))
    throw std::invalid_argument("curve: --step must be positive and --from below --to");
  const double limit = model::friction::kIdentifiedSpeed_rad_per_s;
  const double furthest = std::max(std::abs(options.from_rad_per_s), std::abs(options.to_rad_per_s));
  if (furthest > limit && !options.quiet)
    std::fprintf(stderr, "youbot-bench: nothing was measured beyond %g rad/s; the value there is held\n",
                 limit);
  std::printf("velocity_rad_per_s,torque_Nm\n");
  for (double n = 0; n <= rows; ++n) {
    const double velocity = options.from_rad_per_s + n * options.step_rad_per_s;
    std::printf("%.10g,%.9g\n", velocity, model::friction::wheel_curve_Nm(options.wheel, velocity));
  }
}

Subcommand add_curve(CLI::App& app) {
  const auto options = std::make_shared<CurveOptions>();
  CLI::App* const command = app.add_subcommand("curve", "print the measured friction curve of a wheel");
  command->add_option("--wheel", options->wheel, "number of the wheel")
      ->check(runtime::finite_range(1, 4))
      ->required();
  command->add_option("--from", options->from_rad_per_s, "rad/s")
      ->check(runtime::finite_range(-1000, 1000))
      ->capture_default_str();
  command->add_option("--to", options->to_rad_per_s, "rad/s")
      ->check(runtime::finite_range(-1000, 1000))
      ->capture_default_str();
  command->add_option("--step", options->step_rad_per_s, "rad/s")
      ->check(runtime::finite_range(1e-6, 1000))
      ->capture_default_str();
  command->add_flag("--quiet", options->quiet,
                    "print the table only, without a note on speeds that were not measured");
  return {command, [options] {
            print_curve(*options);
            return runtime::kExitOk;
          }};
}

}  // namespace youbot_bench
