#include "tests/gap_second/cases.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace gap_second {
namespace {

double part(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// The `number`-th that suits the subject, so that many cases take each of them equally often.
std::string effect_for(const Subject& subject, int number) {
  const std::vector<std::string>& all = known_effects();
  for (std::size_t i = static_cast<std::size_t>(number);; ++i)
    if (belongs_to(all[i % all.size()], subject)) return all[i % all.size()];
}

std::string partner_of(const std::string& effect, const Subject& subject, std::mt19937_64& random) {
  const std::vector<std::string>& all = known_effects();
  for (;;) {
    const std::string& other = all[std::uniform_int_distribution<std::size_t>(0, all.size() - 1)(random)];
    if (belongs_to(other, subject) && go_together(effect, other)) return other;
  }
}

bool one_of_hidden(const Case& drawn, const char* effect) {
  return std::find(drawn.hidden.begin(), drawn.hidden.end(), effect) != drawn.hidden.end();
}

/// A laboratory's knowledge: everything except the hidden effects, friction within 3 % and inertia within 0.5
/// %.
BaseModel known_model(const Case& drawn, std::mt19937_64& random) {
  const DriveTruth& truth = drawn.subject.truth;
  const auto hides = [&](const char* effect) { return one_of_hidden(drawn, effect); };
  BaseModel model;
  model.name = drawn.subject.rig.name;
  model.inertia_kg_m2 =
      drawn.subject.rig.nominal_inertia_kg_m2 * (hides("inertia") ? 1 : part(random, 0.995, 1.005));
  if (part(random, 0, 1) < 0.7) model.encoder_ticks_per_rev = drawn.subject.rig.ticks_per_rev;
  if (part(random, 0, 1) < 0.5) model.torque_noise_Nm = drawn.subject.rig.torque_noise_Nm;
  model.effects.push_back({"coulomb", {{"torque_Nm", truth.coulomb_Nm * part(random, 0.97, 1.03)}}});
  if (!hides("viscous"))
    model.effects.push_back(
        {"viscous", {{"coefficient_Nm_s_per_rad", truth.viscous_Nm_s_per_rad * part(random, 0.97, 1.03)}}});
  if (hides("load_friction"))
    model.effects.push_back(
        {"imbalance", {{"torque_Nm", truth.imbalance_Nm}, {"rest_position_rad", truth.rest_position_rad}}});
  return model;
}

void hide(Case& drawn, const std::string& effect, std::mt19937_64& random) {
  hide_effect(effect, drawn.subject, random);
  drawn.hidden.push_back(effect);
}

/// Makes the base model poor. The effects that it then lacks are hidden ones, too.
void impoverish(Case& drawn, int number, std::mt19937_64& random) {
  static const std::vector<std::string> kinds = {"inertia only",     "Coulomb only",   "inertia x 10",
                                                 "inertia / 10",     "inertia x 1000", "inertia / 1000",
                                                 "friction 30 % off"};
  const std::string& kind = kinds[static_cast<std::size_t>(number) % kinds.size()];
  std::vector<ModelEffect>& effects = drawn.base.effects;
  drawn.kind = kind + (drawn.hidden.empty() ? "" : " and an effect");
  if (kind == "inertia only" || kind == "Coulomb only") {
    std::erase_if(effects, [&](const ModelEffect& effect) {
      return effect.type == "viscous" || (effect.type == "coulomb" && kind == "inertia only");
    });
    if (kind == "inertia only") drawn.hidden.emplace_back("coulomb");
    drawn.hidden.emplace_back("viscous");
    drawn.subject.parameters["coulomb.torque_Nm"] = drawn.subject.truth.coulomb_Nm;
    drawn.subject.parameters["viscous.coefficient_Nm_s_per_rad"] = drawn.subject.truth.viscous_Nm_s_per_rad;
  } else if (kind == "friction 30 % off") {
    for (ModelEffect& effect : effects)
      for (auto& [name, value] : effect.parameters)
        if (effect.type != "imbalance") value *= part(random, 0, 1) < 0.5 ? 0.7 : 1.3;
    drawn.also_fine = {"coulomb", "viscous"};
  } else {
    const double factor = kind.ends_with("1000") ? 1000 : 10;
    drawn.base.inertia_kg_m2 *= kind.find('x') != std::string::npos ? factor : 1 / factor;
    drawn.hidden.emplace_back("inertia");
  }
}

/// Sometimes a rig has one torque only; not where that would take the evidence away.
void choose_columns(Case& drawn, std::mt19937_64& random) {
  const auto hides = [&](const char* effect) { return one_of_hidden(drawn, effect); };
  const double which = part(random, 0, 1);
  if (!drawn.bad_data.empty() || hides("unsigned_current")) return;
  const bool in_actuator = hides("transport_delay") || hides("torque_deadband");
  drawn.measured_column = which > (in_actuator ? 0.5 : 0.15);
  drawn.command_column = in_actuator || which < 0.85;
}

void finish(Case& drawn, std::mt19937_64& random) {
  choose_columns(drawn, random);
  // Seen from the command alone the current's lag is a delay; below half a period the program gives it no
  // name.
  if (!drawn.measured_column && drawn.subject.truth.current_lag_s > 0.4 / drawn.subject.rig.rate_Hz)
    drawn.also_fine.insert("transport_delay");
  auto& parameters = drawn.subject.parameters;
  parameters["inertia_kg_m2"] = drawn.subject.truth.inertia_kg_m2;
  parameters.emplace("coulomb.torque_Nm", drawn.subject.truth.coulomb_Nm);
  parameters.emplace("viscous.coefficient_Nm_s_per_rad", drawn.subject.truth.viscous_Nm_s_per_rad);
  // Without a measured torque the current's lag adds to the delay.
  if (!drawn.measured_column && one_of_hidden(drawn, "transport_delay"))
    parameters["transport_delay.delay_s"] += drawn.subject.truth.current_lag_s;
  if (one_of_hidden(drawn, "thermal_drift"))
    parameters.erase("coulomb.torque_Nm");  // cold or warm: unspecified
  // An inertia effect and a refit of the inertia are equivalent; neither alone has a true value.
  if (one_of_hidden(drawn, "inertia")) parameters.erase("inertia_kg_m2");
  if (drawn.bad_data == "torque in mN m" || drawn.bad_data.ends_with("degrees") ||
      drawn.bad_data.ends_with("milliseconds") || drawn.bad_data.ends_with("motor side"))
    parameters.clear();                                  // true in other units than the file's
  if (!drawn.unknown_cause.empty()) parameters.clear();  // it has a share in each of them
}

}  // namespace

Case draw_case(char case_class, int number, std::uint64_t seed) {
  if (case_class == 0 || std::strchr(kClasses, case_class) == nullptr)
    throw std::invalid_argument(std::string("there is no class ") + case_class);
  std::seed_seq sequence{seed, static_cast<std::uint64_t>(case_class), static_cast<std::uint64_t>(number)};
  std::mt19937_64 random(sequence);
  Case drawn;
  drawn.id = std::string(1, case_class) + "-" + std::to_string(number);
  drawn.subject = draw_subject(random);
  drawn.seed = random();
  const auto kinds = static_cast<int>(case_class == 'd' ? kinds_of_bad_data().size() : 7);
  const bool with_effect = number / kinds % 2 == 1;
  // With bad data or a poor base: effects that every recording shows.
  static const std::vector<std::string> plain = {"stribeck", "cogging", "quadratic_drag", "imbalance",
                                                 "midspeed_dip"};
  if (case_class == 'b') hide(drawn, effect_for(drawn.subject, number), random);
  if (case_class == 'c') {
    hide(drawn, effect_for(drawn.subject, number), random);
    hide(drawn, partner_of(drawn.hidden.front(), drawn.subject, random), random);
  }
  if (case_class == 'd') drawn.bad_data = kinds_of_bad_data()[static_cast<std::size_t>(number % kinds)].name;
  if ((case_class == 'd' || case_class == 'e') && with_effect)
    hide(drawn, plain[random() % plain.size()], random);
  if (case_class == 'f') {
    drawn.unknown_cause = unknown_causes()[static_cast<std::size_t>(number) % unknown_causes().size()];
    hide_unknown_cause(drawn.unknown_cause, drawn.subject, random);
  }
  drawn.base = known_model(drawn, random);
  drawn.kind = case_class == 'b' ? drawn.hidden.front() : drawn.bad_data + drawn.unknown_cause;
  if (case_class == 'c') drawn.kind = "pairs";
  if (case_class == 'd' && with_effect) drawn.kind += " and an effect";
  if (case_class == 'e') impoverish(drawn, number, random);
  finish(drawn, random);
  return drawn;
}

CaseFiles write_case(const Case& drawn, const std::string& directory) {
  CaseFiles files;
  files.base = directory + "/base.toml";
  drawn.base.write(files.base);
  std::mt19937_64 random(drawn.seed);
  const auto write = [&](Motion motion, const std::string& file_name) {
    Recording recording =
        record(drawn.subject.truth, drawn.subject.rig, motion, drawn.subject.seconds, random());
    if (drawn.subject.unsigned_current)
      for (double& torque : recording.at("torque_measured_Nm")) torque = std::abs(torque);
    if (!drawn.command_column) recording.remove_column("torque_command_Nm");
    if (!drawn.measured_column) recording.remove_column("torque_measured_Nm");
    if (!drawn.bad_data.empty()) spoil(drawn.bad_data, recording, random);
    recording.write(directory + "/" + file_name);
    return directory + "/" + file_name;
  };
  for (Motion motion :
       {Motion::kStaircase, Motion::kSlowReversals, Motion::kMultisine, Motion::kTorqueTriangles})
    files.data.push_back(write(motion, std::string(name(motion)) + ".csv"));
  for (Motion motion : {Motion::kRandomSteps, Motion::kMultisine, Motion::kSlowReversals})
    files.held_out.push_back(write(motion, std::string("held-out-") + name(motion) + ".csv"));
  return files;
}

}  // namespace gap_second
