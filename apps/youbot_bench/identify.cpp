#include "apps/youbot_bench/identify.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string_view>

#include "apps/common/recording_reader.h"
#include "apps/youbot_bench/identify_report.h"
#include "apps/youbot_bench/model_writer.h"
#include "sim/identify/model_choice.h"
#include "sim/identify/moving_fit.h"
#include "sim/identify/presliding_fit.h"
#include "sim/identify/static_fit.h"
#include "sim/identify/static_map.h"

namespace youbot_bench {
namespace {

namespace fits = sim::identify;
using fits::Estimate;

struct Unit {
  std::string_view suffix;
  std::string_view unit;
};
/// The longer before those they end with.
constexpr auto kUnits = std::to_array<Unit>({{"_Nm_s2_per_rad2", "N·m·s²/rad²"},
                                             {"_Nm_s_per_rad", "N·m·s/rad"},
                                             {"_Nm_per_rad", "N·m/rad"},
                                             {"_rad_per_s", "rad/s"},
                                             {"_kg_m2", "kg·m²"},
                                             {"_Nm", "N·m"},
                                             {"_rad", "rad"},
                                             {"_s", "s"}});

void print_estimates(const std::vector<Estimate>& estimates) {
  std::printf("  %-20s %12s   %-26s %s\n", "parameter", "value", "95 % interval", "unit");
  for (const Estimate& estimate : estimates) {
    std::string name = estimate.name;
    std::string_view unit;
    for (const Unit& known : kUnits)
      if (name.ends_with(known.suffix)) {
        name.resize(name.size() - known.suffix.size());
        unit = known.unit;
        break;
      }
    std::replace(name.begin(), name.end(), '_', ' ');
    const bool given = estimate.not_identifiable.starts_with("given");
    char value[24] = "-";
    if (estimate.ok() || given) std::snprintf(value, sizeof value, "%.5g", estimate.value);
    char interval[64];
    std::snprintf(interval, sizeof interval, "%.5g … %.5g", estimate.lower, estimate.upper);
    if (estimate.ok())
      std::printf("  %-20s %12s   %-28s %s\n", name.c_str(), value, interval, std::string(unit).c_str());
    else
      std::printf("  %-20s %12s   %s%s\n", name.c_str(), value,
                  given ? "" : "not identifiable: ", estimate.not_identifiable.c_str());
  }
}

void print_verdicts(const std::vector<std::string>& verdicts) {
  for (const std::string& verdict : verdicts) std::printf("  ! %s\n", verdict.c_str());
}

sim::Recording read(const std::filesystem::path& path) {
  apps::ReadRecording read = apps::read_recording(path);
  for (const std::string& warning : read.warnings) spdlog::warn("{}", warning);
  return std::move(read.recording);
}

/// "kfm+offset" → the form.
fits::StaticForm form_of(std::string_view text) {
  const std::size_t plus = text.find('+');
  fits::StaticForm form{.law = std::string(text.substr(0, plus))};
  while (text.find('+') != text.npos) {
    text.remove_prefix(text.find('+') + 1);
    const std::string_view term = text.substr(0, text.find('+'));
    if (term == "offset")
      form.torque_offset = true;
    else if (term == "asymmetry")
      form.viscous_asymmetry = true;
    else if (term == "quadratic")
      form.quadratic = true;
    else
      throw std::invalid_argument("--law: '" + std::string(term) +
                                  "' is no term; there are offset, asymmetry and quadratic");
  }
  static_cast<void>(control::friction::law_description(form.law));  // throws with the list
  return form;
}

/// Rigs of all files must agree; the first that was named counts.
void require_rig(std::string& rig, const sim::Recording& recording, const std::filesystem::path& path) {
  if (rig.empty()) rig = recording.rig;
  if (recording.rig != rig)
    throw std::invalid_argument(path.string() + ": is of rig '" + recording.rig + "', the others are of '" +
                                rig + "'; identify one rig at a time");
}

fits::StaticFit identify_map(IdentificationEvidence& evidence, const std::string& law) {
  const fits::StaticMap& map = evidence.map;
  fits::StaticForm form;
  if (law == "auto") {
    const fits::ModelChoice& choice = evidence.choice.emplace(fits::choose_model(map));
    form = choice.form;
    std::printf("choice of terms, each speed predicted from the others:\n");
    for (const fits::ChoiceStep& step : choice.steps)
      std::printf("  %-38s %7.2f %% -> %.2f %%, by chance p = %.3f: %s\n", fits::term_name(step.term),
                  step.held_out_before_percent, step.held_out_after_percent, step.p_value,
                  step.added ? "added" : (step.removal ? "taken out" : "not added"));
    print_verdicts(choice.verdicts);
  } else {
    form = form_of(law);
  }
  fits::StaticFit fit = fits::fit_static(map, form);
  std::printf("sliding: %s, %zu points of %s\n", fits::form_name(form).c_str(), map.points.size(),
              map.rig.empty() ? "an unnamed rig" : map.rig.c_str());
  print_estimates(fit.parameters);
  if (fit.ok())
    std::printf("  error %.2f %%, leave-one-speed-out %.2f %%, scatter %.3g N·m, condition %.3g\n",
                fit.relative_error_percent, fit.leave_one_out_percent, fit.scatter_Nm, fit.condition);
  for (const std::size_t i : fit.outliers)
    std::printf("  left out: %.4g N·m at %.4g rad/s is far from the law\n", map.points[i].torque_Nm,
                map.points[i].velocity_rad_per_s);
  print_verdicts(fit.verdicts);
  return fit;
}

/// The sliding friction that a pre-sliding fit stands on.
control::friction::Kfm::Parameters sliding_of(const fits::StaticFit& fit) {
  control::friction::Kfm::Parameters parameters;
  const auto take = [&fit](std::string_view name, double& value) {
    const bool there = std::any_of(fit.parameters.begin(), fit.parameters.end(),
                                   [&](const Estimate& e) { return e.name == name && !std::isnan(e.value); });
    if (there) value = fit.parameter(name).value;
    return there;
  };
  if (!fit.ok() || !take("coulomb_Nm", parameters.coulomb_Nm))
    throw std::invalid_argument("--presliding: the map gave no Coulomb friction to stand on");
  take("viscous_Nm_s_per_rad", parameters.viscous_Nm_s_per_rad);
  const bool peak = take("stribeck_velocity_rad_per_s", parameters.stribeck_velocity_rad_per_s) &&
                    take("static_Nm", parameters.static_Nm);
  take("stribeck_exponent", parameters.stribeck_exponent);
  if (!peak) parameters.static_Nm = parameters.coulomb_Nm;
  return parameters;
}

}  // namespace

void identify(const IdentifyOptions& options) {
  if (options.maps.empty() && options.presliding.empty() && options.moving.empty())
    throw std::invalid_argument("identify: give --map, --moving or --presliding");
  if (!options.presliding.empty() && options.maps.empty())
    throw std::invalid_argument("--presliding: needs the sliding friction too; give its map with --map");
  if (!options.presliding.empty() && !options.inertia_kg_m2 && options.moving.empty())
    throw std::invalid_argument(
        "--presliding: needs the inertia; give --inertia or a recording with --moving");
  if (options.inertia_kg_m2 && !(*options.inertia_kg_m2 > 0 && std::isfinite(*options.inertia_kg_m2)))
    throw std::invalid_argument("--inertia: must be a positive number of kg·m²");
  if (options.law != "auto") static_cast<void>(form_of(options.law));

  // All files first: a mistake in the last one shows before the work.
  std::string rig;
  IdentifiedModel model;
  std::vector<sim::Recording> maps;
  for (const auto& path : options.maps) {
    maps.push_back(read(path));
    require_rig(rig, maps.back(), path);
    model.evidence.push_back("sliding friction from " + path.filename().string());
  }
  std::optional<sim::Recording> moving;
  if (!options.moving.empty()) {
    moving = read(options.moving);
    require_rig(rig, *moving, options.moving);
    model.evidence.push_back("motion from " + options.moving.filename().string());
  }
  std::optional<sim::Recording> presliding;
  if (!options.presliding.empty()) {
    presliding = read(options.presliding);
    require_rig(rig, *presliding, options.presliding);
    model.evidence.push_back("pre-sliding from " + options.presliding.filename().string());
  }
  model.name = rig.empty() ? "unnamed" : rig;
  model.inertia_kg_m2 = options.inertia_kg_m2;

  IdentificationEvidence evidence;
  if (!maps.empty()) {
    evidence.map = fits::static_map(maps);
    model.sliding = identify_map(evidence, options.law);
  }
  if (moving) {
    const fits::MovingFit fit = fits::fit_moving(*moving);
    std::printf("moving: inertia and friction together, %zu samples\n", fit.used);
    print_estimates(fit.parameters);
    std::printf("  error %.2f %%, condition %.3g\n", fit.relative_error_percent, fit.condition);
    print_verdicts(fit.verdicts);
    model.moving = fit.parameters;
    if (!model.inertia_kg_m2 && fit.parameter("inertia_kg_m2").ok())
      model.inertia_kg_m2 = fit.parameter("inertia_kg_m2").value;
  }
  if (presliding) {
    if (!model.inertia_kg_m2)
      throw std::invalid_argument("--presliding: the moving recording gave no inertia; give --inertia");
    const fits::PreslidingFit fit = fits::fit_presliding(
        *presliding, {.inertia_kg_m2 = *model.inertia_kg_m2, .sliding = sliding_of(*model.sliding)});
    std::printf("pre-sliding: LuGre by simulation\n");
    print_estimates(fit.parameters);
    if (fit.rms_error_rad > 0)
      std::printf("  error %.3g rad rms, %.2f %%\n", fit.rms_error_rad, fit.relative_error_percent);
    print_verdicts(fit.verdicts);
    model.presliding = fit.parameters;
  }
  write_model(model, options.out);
  write_identify_report(model, evidence, options.out);
  std::printf("written: %s and report.html\n", (options.out / "model.toml").string().c_str());
}

}  // namespace youbot_bench
