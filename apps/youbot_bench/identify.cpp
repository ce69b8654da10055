#include "apps/youbot_bench/identify.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string_view>

#include "apps/common/quantity.h"
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

void print_estimates(const std::vector<Estimate>& estimates) {
  std::printf("  %-20s %12s   %-26s %s\n", "parameter", "value", "95 % interval", "unit");
  for (const Estimate& estimate : estimates) {
    const auto [name, unit] = apps::quantity_of(estimate.name);
    const bool given = is_given(estimate);
    char value[24] = "-";
    if (estimate.ok() || given) std::snprintf(value, sizeof value, "%.5g", estimate.value);
    char interval[64];
    std::snprintf(interval, sizeof interval, "%.5g … %.5g", estimate.lower, estimate.upper);
    if (estimate.ok())
      std::printf("  %-20s %12s   %-28s %s\n", name.c_str(), value, interval, unit.c_str());
    else
      std::printf("  %-20s %12s   %s%s\n", name.c_str(), value,
                  given ? "" : "not identifiable: ", estimate.not_identifiable.c_str());
  }
}

void print_verdicts(const std::vector<std::string>& verdicts) {
  for (const std::string& verdict : verdicts) std::printf("  ! %s\n", verdict.c_str());
}

sim::Recording read(const std::filesystem::path& path,
                    apps::NotMeasured not_measured = apps::NotMeasured::kRefused) {
  apps::ReadRecording read = apps::read_recording(path, not_measured);
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

/// The maps that `path` names: itself, or those in a directory, also one that an experiment has written to.
std::vector<std::filesystem::path> maps_at(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return {path};
  std::filesystem::path directory = path / fits::kStaticMapExperiment;
  if (!std::filesystem::is_directory(directory, error)) directory = path;
  std::vector<std::filesystem::path> maps;
  for (auto entry = std::filesystem::directory_iterator(directory, error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error))
    if (entry->path().extension() == ".csv") maps.push_back(entry->path());
  if (error) throw std::invalid_argument("--map: " + directory.string() + ": " + error.message());
  if (maps.empty()) throw std::invalid_argument("--map: there is no .csv in " + directory.string());
  std::ranges::sort(maps);
  return maps;
}

/// All recordings of one drive.
struct Rig {
  IdentifiedRig identified;
  std::vector<sim::Recording> maps{};
};

/// The one of this name, added when it is not there yet.
Rig& rig_named(std::vector<Rig>& rigs, const std::string& name) {
  const std::string known = name.empty() ? "unnamed" : name;
  const auto found =
      std::ranges::find_if(rigs, [&](const Rig& rig) { return rig.identified.model.name == known; });
  if (found != rigs.end()) return *found;
  rigs.push_back({});
  rigs.back().identified.model.name = known;
  return rigs.back();
}

/// Motion and pre-sliding are of one rig, and so must be everything beside them.
void require_one_rig(const std::vector<Rig>& rigs, const std::filesystem::path& path) {
  if (rigs.size() > 1)
    throw std::invalid_argument(path.string() + ": is of rig '" + rigs.back().identified.model.name +
                                "', the others are of '" + rigs.front().identified.model.name +
                                "'; with --moving or --presliding identify one rig at a time");
}

/// Each of several drives has a directory of its own, named after it.
void require_directory_names(const std::vector<Rig>& rigs) {
  if (rigs.size() < 2) return;
  for (const Rig& rig : rigs) {
    const std::string& name = rig.identified.model.name;
    if (name.find_first_of(std::string_view("/\0", 2)) != name.npos || name == "." || name == "..")
      throw std::invalid_argument("rig '" + name + "' cannot name a directory; identify it alone");
  }
}

/// "fitted without speeds from 1 to 4 rad/s".
std::string restriction(const fits::SpeedRange& speeds) {
  const auto [low, high] = std::minmax(speeds.above_rad_per_s, speeds.below_rad_per_s);
  char text[96];
  if (std::isfinite(high))
    std::snprintf(text, sizeof text, "speeds from %.4g to %.4g rad/s", low, high);
  else
    std::snprintf(text, sizeof text, "speeds from %.4g rad/s on", low);
  const bool between = speeds.above_rad_per_s < speeds.below_rad_per_s;
  return std::string("fitted ") + (between ? "to " : "without ") + text;
}

/// Before the fit, so that nothing of what is left out decides about a term or an outlier.
void restrict_map(IdentifiedRig& rig, const fits::SpeedRange& speeds) {
  auto& [model, evidence] = rig;
  const std::size_t all = evidence.map.points.size();
  evidence.not_asked_for = fits::leave_out(evidence.map, speeds);
  if (evidence.not_asked_for.empty()) return;
  if (evidence.map.points.empty())
    throw std::invalid_argument("--speeds-above, --speeds-below: no speed in the map of " + model.name +
                                " is left to fit");
  std::string line = restriction(speeds) + ": " + std::to_string(evidence.not_asked_for.size()) + " of " +
                     std::to_string(all) + " points left out, at";
  for (const fits::MapPoint& point : evidence.not_asked_for) {
    char velocity[24];
    std::snprintf(velocity, sizeof velocity, " %.4g", point.velocity_rad_per_s);
    line += velocity;
  }
  model.evidence.push_back(line + " rad/s");
  std::printf("%s\n", model.evidence.back().c_str());
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

void identify_rig(Rig& rig, const std::optional<sim::Recording>& moving,
                  const std::optional<sim::Recording>& presliding, const IdentifyOptions& options) {
  auto& [model, evidence] = rig.identified;
  model.inertia_kg_m2 = options.inertia_kg_m2;
  if (!rig.maps.empty()) {
    evidence.map = fits::static_map(rig.maps);
    restrict_map(rig.identified, options.speeds);
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
  if (!model.inertia_kg_m2)
    std::printf(
        "inertia: nothing here tells it; the model has %g kg·m², assumed. Give --moving or --inertia\n",
        kAssumedInertia_kg_m2);
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
  const auto [above, below] = options.speeds;
  if (!(above >= 0 && below > 0 && std::isfinite(above)) || above == below)
    throw std::invalid_argument("--speeds-above, --speeds-below: must be two different speeds, in rad/s");
  if (options.maps.empty() && (above > 0 || std::isfinite(below)))
    throw std::invalid_argument("--speeds-above, --speeds-below: choose from a map; give it with --map");

  // All files first: a mistake in the last one shows before the work.
  std::vector<Rig> rigs;
  for (const auto& named : options.maps)
    for (const auto& path : maps_at(named)) {
      sim::Recording map = read(path, apps::NotMeasured::kTaken);
      Rig& rig = rig_named(rigs, map.rig);
      rig.identified.model.evidence.push_back("sliding friction from " + path.filename().string());
      rig.maps.push_back(std::move(map));
    }
  const auto read_beside = [&rigs](const std::filesystem::path& path, const std::string& what) {
    std::optional<sim::Recording> recording;
    if (path.empty()) return recording;
    recording = read(path);
    Rig& rig = rig_named(rigs, recording->rig);
    require_one_rig(rigs, path);
    rig.identified.model.evidence.push_back(what + " from " + path.filename().string());
    return recording;
  };
  const std::optional<sim::Recording> moving = read_beside(options.moving, "motion");
  const std::optional<sim::Recording> presliding = read_beside(options.presliding, "pre-sliding");
  require_directory_names(rigs);

  std::vector<IdentifiedRig> identified;
  for (Rig& rig : rigs) {
    if (rigs.size() > 1) std::printf("== %s\n", rig.identified.model.name.c_str());
    identify_rig(rig, moving, presliding, options);
    identified.push_back(std::move(rig.identified));
  }
  for (const IdentifiedRig& rig : identified) {
    const std::filesystem::path directory =
        identified.size() > 1 ? options.out / rig.model.name : options.out;
    write_model(rig.model, directory);
    std::printf("written: %s\n", (directory / "model.toml").string().c_str());
  }
  write_identify_report(identified, options.out);
  std::printf("report: %s\n", (options.out / "report.html").string().c_str());
}

}  // namespace youbot_bench
