#include "model/effects/empirical.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace model::effects {
namespace {

using Along = Empirical::Along;
using Times = Empirical::Times;

bool is_position(Along along) noexcept { return along == Along::kPosition || along == Along::kTurn; }

}  // namespace

std::string_view Empirical::name_of(Along along) noexcept {
  return kAlong[static_cast<std::size_t>(along)].first;
}

std::string_view Empirical::name_of(Times times) noexcept {
  return kTimes[static_cast<std::size_t>(times)].first;
}

std::string_view Empirical::unit_of(Times times) noexcept {
  return times == Times::kVelocity ? "N·m·s/rad" : times == Times::kLoad ? "" : "N·m";
}

bool Empirical::is_term(Along along, Times times) noexcept {
  switch (times) {
    case Times::kOne: return along == Along::kVelocity || is_position(along);
    case Times::kDirection: return along != Along::kVelocity;
    case Times::kVelocity: return is_position(along);
    case Times::kLoad: return along == Along::kVelocity;
  }
  return false;
}

Empirical::Empirical(std::vector<Term> terms) : terms_(std::move(terms)) {
  const std::string name(kName);
  if (terms_.empty() || terms_.size() > kMaxTerms)
    throw std::invalid_argument("effect " + name + ": it needs 1 to " + std::to_string(kMaxTerms) + " terms");
  for (const Term& term : terms_) {
    if (!is_term(term.along, term.times))
      throw std::invalid_argument("effect " + name + ": there is no term over " +
                                  std::string(name_of(term.along)) + " times " +
                                  std::string(name_of(term.times)));
    if (term.table.repeats() != (term.along == Along::kTurn))
      throw std::invalid_argument("effect " + name + ": a table repeats if and only if it is over a turn");
    if (term.table.values().size() > kMaxValues)
      throw std::invalid_argument("effect " + name + ": a table has more than " + std::to_string(kMaxValues) +
                                  " values");
  }
}

double Empirical::level_Nm(const Sliding& sliding) const noexcept {
  double level = 0;
  for (const Term& term : terms_) {
    if (term.is_load()) continue;
    double x = 0;
    switch (term.along) {
      case Along::kVelocity: x = sliding.direction * sliding.speed_rad_per_s; break;
      case Along::kPosition:
      case Along::kTurn: x = sliding.position_rad; break;
      case Along::kLoad: x = sliding.load_Nm; break;
      case Along::kSinceReversal: x = sliding.since_reversal_s; break;
    }
    const double factor = term.times == Times::kOne        ? sliding.direction
                          : term.times == Times::kVelocity ? sliding.speed_rad_per_s
                          : term.times == Times::kLoad     ? sliding.load_Nm
                                                           : 1;
    level += factor * term.table.at(x);
  }
  return level;
}

double Empirical::load_Nm(double position_rad) const noexcept {
  double load = 0;
  for (const Term& term : terms_)
    if (term.is_load()) load += term.table.at(position_rad);
  return load;
}

double Empirical::least_level_Nm(double speed_rad_per_s, double direction,
                                 double largest_load_Nm) const noexcept {
  double level = 0;
  for (const Term& term : terms_) {
    if (term.is_load()) continue;
    switch (term.times) {
      case Times::kOne: level += direction * term.table.at(direction * speed_rad_per_s); break;
      case Times::kDirection: level += term.table.least(); break;
      case Times::kVelocity: level += speed_rad_per_s * term.table.least(); break;
      case Times::kLoad:
        level += largest_load_Nm * std::min(0.0, term.table.at(direction * speed_rad_per_s));
        break;
    }
  }
  return level;
}

}  // namespace model::effects
