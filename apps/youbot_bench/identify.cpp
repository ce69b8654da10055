#include "apps/youbot_bench/identify.h"

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "apps/youbot_bench/identify_report.h"
#include "apps/youbot_bench/model_writer.h"
#include "identification/fit/model_choice.h"
#include "identification/fit/moving_fit.h"
#include "identification/fit/presliding_fit.h"
#include "identification/fit/static_fit.h"
#include "identification/fit/static_map.h"
#include "model/effects/dissipation.h"
#include "model/friction/any_law.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/finite_range.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/log.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/wording.h"
#include "runtime/recording/output_directory.h"
#include "runtime/recording/recording_reader.h"

namespace youbot_bench {
namespace {

namespace fits = identification::fit;
using fits::Estimate;

/// Prints on the terminal, unless quiet.
class Teller {
 public:
  explicit Teller(bool quiet) : quiet_(quiet) {}
  template <typename... Values>
  void operator()(fmt::format_string<Values...> format, Values&&... values) const {
    if (!quiet_) fmt::print(format, std::forward<Values>(values)...);
  }

 private:
  bool quiet_;
};

void print_estimates(const Teller& tell, const std::vector<Estimate>& estimates) {
  tell("  {:<27} {:>12}   {:<26} {}\n", "parameter", "value", "95 % interval", "unit");
  for (const Estimate& estimate : estimates) {
    const auto [name, unit] = quantity_of(estimate);
    const bool given = is_given(estimate);
    if (estimate.ok()) {
      const auto text = runtime::interval_text(estimate.value, estimate.lower, estimate.upper, 5, 5);
      tell("  {:<27} {:>12}   {:<26} {}\n", name, text.value, text.lower + " … " + text.upper, unit);
    } else {
      tell("  {:<27} {:>12}   {}{}\n", name, given ? fmt::format("{:.5g}", estimate.value) : "-",
           given ? "" : "not identifiable: ", estimate.not_identifiable);
    }
  }
}

void print_verdicts(const Teller& tell, const std::vector<std::string>& verdicts) {
  for (const std::string& verdict : verdicts) tell("  ! {}\n", verdict);
}

/// "added", or why it was not.
std::string decision_of(const fits::ChoiceStep& step) {
  if (step.added) return "added";
  return std::string(step.removal ? "taken out" : "not added") +
         (step.drives ? ", friction would drive the joint" : "");
}

identification::Recording read(const std::filesystem::path& path, const runtime::ReadOptions& options) {
  runtime::ReadRecording read = runtime::read_recording(path, options);
  for (const std::string& warning : read.warnings) spdlog::warn("{}", warning);
  return std::move(read.recording);
}

/// The maps at `path`: the file itself, or those in a directory, including an experiment's directory.
std::vector<std::filesystem::path> maps_at(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return {path};
  std::filesystem::path directory = path / fits::kStaticMapExperiment;
  if (!std::filesystem::is_directory(directory, error)) directory = path;
  std::vector<std::filesystem::path> maps;
  for (auto entry = std::filesystem::directory_iterator(directory, error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error))
    if (runtime::is_recording(*entry)) maps.push_back(entry->path());
  if (error) throw std::invalid_argument("--map: " + directory.string() + ": " + error.message());
  if (maps.empty()) throw std::invalid_argument("--map: there is no .csv or .mcap in " + directory.string());
  std::ranges::sort(maps);
  return maps;
}

/// All recordings of one drive.
struct Rig {
  IdentifiedRig identified;
  std::vector<identification::Recording> maps{};
};

/// The rig of this name, added if it is new.
Rig& rig_named(std::vector<Rig>& rigs, const std::string& name) {
  const std::string known = name.empty() ? "unnamed" : name;
  const auto found =
      std::ranges::find_if(rigs, [&](const Rig& rig) { return rig.identified.model.name == known; });
  if (found != rigs.end()) return *found;
  rigs.push_back({});
  rigs.back().identified.model.name = known;
  return rigs.back();
}

/// Motion and presliding belong to one rig, so all other recordings must, too.
void require_one_rig(const std::vector<Rig>& rigs, const std::filesystem::path& path) {
  if (rigs.size() > 1)
    throw std::invalid_argument(path.string() + ": is of rig '" + rigs.back().identified.model.name +
                                "', the others are of '" + rigs.front().identified.model.name +
                                "'; with --moving or --presliding identify one rig at a time");
}

/// Each of several drives has its own directory, named after it.
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
  const std::string text = std::isfinite(high) ? fmt::format("speeds from {:.4g} to {:.4g} rad/s", low, high)
                                               : fmt::format("speeds from {:.4g} rad/s on", low);
  const bool between = speeds.above_rad_per_s < speeds.below_rad_per_s;
  return std::string("fitted ") + (between ? "to " : "without ") + text;
}

/// Before the fit, so that excluded points do not affect a term or an outlier.
void restrict_map(const Teller& tell, IdentifiedRig& rig, const fits::SpeedRange& speeds) {
  auto& [model, evidence] = rig;
  const std::size_t all = evidence.map.points.size();
  evidence.not_asked_for = fits::leave_out(evidence.map, speeds);
  if (evidence.not_asked_for.empty()) return;
  if (evidence.map.points.empty())
    throw std::invalid_argument("--speeds-above, --speeds-below: no speed in the map of " + model.name +
                                " is left to fit");
  std::string line = restriction(speeds) + ": " + std::to_string(evidence.not_asked_for.size()) + " of " +
                     std::to_string(all) + " points left out";
  // More of them hide the rest, and the range says which they are.
  constexpr std::size_t kListed = 16;
  if (evidence.not_asked_for.size() <= kListed) {
    line += ", at";
    for (const fits::MapPoint& point : evidence.not_asked_for)
      line += fmt::format(" {:.4g}", point.velocity_rad_per_s);
    line += " rad/s";
  }
  model.evidence.push_back(line);
  tell("{}\n", model.evidence.back());
}

/// "friction measured from -8 to -0.05 and from 0.05 to 8 rad/s: beyond, this model is a guess".
std::string measured_range(const fits::StaticMap& map) {
  std::string text;
  for (const double sign : {-1.0, 1.0}) {
    double slowest = std::numeric_limits<double>::infinity();
    double fastest = 0;
    for (const fits::MapPoint& point : map.points) {
      const double speed = sign * point.velocity_rad_per_s;
      if (speed < 0) continue;
      slowest = std::min(slowest, speed);
      fastest = std::max(fastest, speed);
    }
    if (fastest == 0) continue;
    text +=
        (text.empty() ? "" : " and ") +
        fmt::format("from {:.4g} to {:.4g}", sign > 0 ? slowest : -fastest, sign > 0 ? fastest : -slowest);
  }
  return "friction measured " + text + " rad/s: beyond, this model is a guess";
}

fits::StaticFit identify_map(const Teller& tell, IdentificationEvidence& evidence, const std::string& law) {
  const fits::StaticMap& map = evidence.map;
  fits::StaticForm form;
  fits::StaticFitOptions options;
  if (law == "auto") {
    const fits::ModelChoice& choice = evidence.choice.emplace(
        fits::choose_model(map, {.top_speed_rad_per_s = model::effects::kUsualTopSpeed_rad_per_s}));
    form = choice.form;
    options.left_out = choice.outliers;
    tell("choice of terms, leave-one-speed-out error without and with each:\n");
    for (const fits::ChoiceStep& step : choice.steps)
      tell("  {:<38} {:7.2f} % -> {:.2f} %, by chance p = {:.3f}: {}\n", fits::term_name(step.term),
           step.held_out_before_percent, step.held_out_after_percent, step.p_value, decision_of(step));
    print_verdicts(tell, choice.verdicts);
  } else {
    form = fits::form_named(law);
  }
  fits::StaticFit fit = fits::fit_static(map, form, options);
  tell("sliding: {}, {} points of {}\n", fits::form_name(form), map.points.size(),
       map.rig.empty() ? "an unnamed rig" : map.rig);
  print_estimates(tell, fit.parameters);
  if (fit.ok())
    tell("  error {:.2f} %, leave-one-speed-out {:.2f} %, scatter {:.3g} N·m, condition {:.3g}\n",
         fit.relative_error_percent, fit.leave_one_out_percent, fit.scatter_Nm, fit.condition);
  for (const std::size_t i : fit.outliers)
    tell("  left out: {:.4g} N·m at {:.4g} rad/s is far from the law\n", map.points[i].torque_Nm,
         map.points[i].velocity_rad_per_s);
  print_verdicts(tell, fit.verdicts);
  return fit;
}

/// The sliding friction used by a presliding fit.
model::friction::Kfm::Parameters sliding_of(const fits::StaticFit& fit) {
  const model::effects::DriveModel model{.effects = fit.effects};
  const auto* const coulomb = model.find<model::effects::Coulomb>();
  if (coulomb == nullptr)
    throw std::invalid_argument("--presliding: the map gave no Coulomb friction to stand on");
  model::friction::Kfm::Parameters parameters;
  parameters.coulomb_Nm = parameters.static_Nm = coulomb->parameters().torque_Nm;
  const auto* const viscous = model.find<model::effects::Viscous>();
  parameters.viscous_Nm_s_per_rad = viscous != nullptr ? viscous->parameters().coefficient_Nm_s_per_rad : 0;
  if (const auto* const stribeck = model.find<model::effects::Stribeck>()) {
    parameters.static_Nm = stribeck->parameters().static_torque_Nm;
    parameters.stribeck_velocity_rad_per_s = stribeck->parameters().velocity_rad_per_s;
    parameters.stribeck_exponent = stribeck->parameters().exponent;
  }
  return parameters;
}

/// A model without friction looks like one of a drive that has none.
void require_friction(const IdentifiedModel& model) {
  if (!model.sliding || !drive_model_of(model).effects.empty()) return;
  std::string why;
  for (const std::string& verdict : model.sliding->verdicts) why += ": " + verdict;
  throw std::invalid_argument("no model of " + model.name + " is written: its map determines no friction" +
                              why);
}

/// A law that drives is not friction, and its compensation would drive, too.
void require_braking(const IdentifiedModel& model) {
  const std::string why =
      runtime::driving_friction(drive_model_of(model), model::effects::kUsualTopSpeed_rad_per_s);
  if (!why.empty())
    throw std::invalid_argument(
        "no model of " + model.name + " is written: " + why +
        "; take the terms --law auto finds, or a map with speeds up to those the joint is used at");
}

void identify_rig(const Teller& tell, Rig& rig, const std::optional<identification::Recording>& moving,
                  const std::optional<identification::Recording>& presliding,
                  const IdentifyOptions& options) {
  auto& [model, evidence] = rig.identified;
  model.inertia_kg_m2 = options.inertia_kg_m2;
  if (!rig.maps.empty()) {
    evidence.map = fits::static_map(rig.maps);
    restrict_map(tell, rig.identified, options.speeds);
    model.evidence.push_back(measured_range(evidence.map));
    model.sliding = identify_map(tell, evidence, options.law);
    model.evidence.insert(model.evidence.end(), model.sliding->verdicts.begin(),
                          model.sliding->verdicts.end());
  }
  if (moving) {
    const fits::MovingFit fit = fits::fit_moving(*moving);
    tell("moving: inertia and friction together, {} samples\n", fit.used);
    print_estimates(tell, fit.parameters);
    tell("  error {:.2f} %, condition {:.3g}\n", fit.relative_error_percent, fit.condition);
    if (fit.torque_lag_s != 0) {
      model.evidence.push_back(fmt::format("the torque is taken as recorded {:.3g} ms {}",
                                           1e3 * std::abs(fit.torque_lag_s),
                                           fit.torque_lag_s > 0 ? "late" : "early"));
      tell("  {}\n", model.evidence.back());
    }
    print_verdicts(tell, fit.verdicts);
    model.evidence.insert(model.evidence.end(), fit.verdicts.begin(), fit.verdicts.end());
    model.moving = fit.parameters;
    if (const Estimate& inertia = fits::estimate_of(fit.parameters, "", "inertia_kg_m2");
        !model.inertia_kg_m2 && inertia.ok())
      model.inertia_kg_m2 = inertia.value;
  }
  if (presliding) {
    if (!model.inertia_kg_m2)
      throw std::invalid_argument("--presliding: the moving recording gave no inertia; give --inertia");
    const fits::PreslidingFit fit = fits::fit_presliding(
        *presliding, {.inertia_kg_m2 = *model.inertia_kg_m2, .sliding = sliding_of(*model.sliding)});
    tell("pre-sliding: LuGre by simulation\n");
    print_estimates(tell, fit.parameters);
    if (fit.rms_error_rad > 0)
      tell("  error {:.3g} rad rms, {:.2f} %\n", fit.rms_error_rad, fit.relative_error_percent);
    print_verdicts(tell, fit.verdicts);
    model.presliding = fit.parameters;
  }
  if (!model.inertia_kg_m2)
    tell("inertia: unknown from these recordings; the model assumes {:g} kg·m². Give --moving or --inertia\n",
         kAssumedInertia_kg_m2);
  require_friction(model);
  require_braking(model);
}

/// "coulomb, viscous, …"
std::string law_names() {
  std::string names;
  for (const auto& law : model::friction::law_descriptions())
    if (identification::fit::form_of_law(law)) (names += names.empty() ? "" : ", ") += law.name;
  return names;
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
  if (options.law != "auto") static_cast<void>(fits::form_named(options.law));
  if (options.law != "auto" && options.maps.empty())
    throw std::invalid_argument(
        "--law: is fitted to a map, give it with --map; --moving fits Coulomb and viscous friction only");
  const auto [above, below] = options.speeds;
  if (!(above >= 0 && below > 0 && std::isfinite(above)) || above == below)
    throw std::invalid_argument("--speeds-above, --speeds-below: must be two different speeds, in rad/s");
  if (options.maps.empty() && (above > 0 || std::isfinite(below)))
    throw std::invalid_argument("--speeds-above, --speeds-below: choose from a map; give it with --map");

  // All files first: an error in the last one is reported before the work.
  std::vector<Rig> rigs;
  for (const auto& named : options.maps)
    for (const auto& path : maps_at(named)) {
      identification::Recording map = read(
          path, {.not_measured = runtime::NotMeasured::kTaken, .joint = options.joint, .one_drive = true});
      Rig& rig = rig_named(rigs, map.rig);
      rig.identified.model.evidence.push_back("sliding friction from " + path.filename().string());
      rig.maps.push_back(std::move(map));
    }
  const auto read_beside = [&rigs, &options](const std::filesystem::path& path, const std::string& what) {
    std::optional<identification::Recording> recording;
    if (path.empty()) return recording;
    recording = read(path, {.joint = options.joint, .one_drive = true});
    Rig& rig = rig_named(rigs, recording->rig);
    require_one_rig(rigs, path);
    rig.identified.model.evidence.push_back(what + " from " + path.filename().string());
    return recording;
  };
  const std::optional<identification::Recording> moving = read_beside(options.moving, "motion");
  const std::optional<identification::Recording> presliding = read_beside(options.presliding, "pre-sliding");
  require_directory_names(rigs);
  const auto directory_of = [&](const IdentifiedRig& rig) {
    return rigs.size() > 1 ? options.out / rig.model.name : options.out;
  };
  runtime::require_no_results(options.out, {"report.html"});
  for (const Rig& rig : rigs) runtime::require_no_results(directory_of(rig.identified), {"model.toml"});
  for (const Rig& rig : rigs) runtime::make_output_directory(directory_of(rig.identified));

  const Teller tell(options.quiet);
  std::vector<IdentifiedRig> identified;
  for (Rig& rig : rigs) {
    if (rigs.size() > 1) tell("== {}\n", rig.identified.model.name);
    identify_rig(tell, rig, moving, presliding, options);
    identified.push_back(std::move(rig.identified));
  }
  for (const IdentifiedRig& rig : identified) {
    const std::filesystem::path file = directory_of(rig) / "model.toml";
    runtime::write_whole_file(file, model_text(rig.model));
    tell("written: {}\n", file.string());
  }
  write_identify_report(identified, options.out);
  tell("report: {}\n", (options.out / "report.html").string());
}

Subcommand add_identify(CLI::App& app) {
  const auto options = std::make_shared<IdentifyOptions>();
  CLI::App* const command = app.add_subcommand(
      "identify", "fit a drive model to recordings; reports parameters that they do not determine");
  command->add_option("--map", options->maps, "steady-state maps, one row per speed, or directories of them");
  command->add_option("--moving", options->moving, "recording with changing velocity: inertia, friction");
  command->add_option("--presliding", options->presliding,
                      "recording below break-away: stiffness and damping; with --map and the inertia");
  command->add_option("--joint", options->joint,
                      "joint of an MCAP file with several, such as wheel_1 of base.mcap");
  command
      ->add_option("--law", options->law,
                   "friction law to fit to a map: auto chooses the terms; or one of " + law_names() +
                       ", optionally with +offset, +asymmetry, +quadratic")
      ->capture_default_str();
  command
      ->add_option("--speeds-above", options->speeds.above_rad_per_s,
                   "fit speeds of the map from this one up, rad/s")
      ->check(runtime::finite_range(0, 1e6))
      ->capture_default_str();
  command
      ->add_option("--speeds-below", options->speeds.below_rad_per_s,
                   "fit speeds of the map up to this one, rad/s; if below --speeds-above, the speeds between "
                   "them are left out")
      ->check(runtime::finite_range(0, 1e6));
  command->add_option("--inertia", options->inertia_kg_m2, "known inertia on the joint side, kg·m²")
      ->check(runtime::finite_range(1e-12, 1e6));
  command->add_option("--out", options->out, "directory for model.toml and report.html")->required();
  command->add_flag("--quiet", options->quiet, "print problems only");
  return {command, [options] {
            identify(*options);
            return runtime::kExitOk;
          }};
}

}  // namespace youbot_bench
