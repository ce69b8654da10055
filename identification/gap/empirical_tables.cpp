#include "identification/gap/empirical_tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <numbers>
#include <span>

#include "identification/gap/parallel.h"
#include "model/effects/effect_chain.h"

namespace identification::gap {
namespace {

using model::EvenTable;
using Along = model::effects::Empirical::Along;
using Times = model::effects::Empirical::Times;

constexpr double kTurn_rad = 2 * std::numbers::pi;
/// Share of the rows beyond each end of a table.
constexpr double kBeyond = 0.005;
/// Turns of one recording from which on a table over one turn can be distinguished from one over the stroke.
constexpr double kTurnsToRepeat = 1.5;
/// A stroke of more turns would need a finer table than any cause over it.
constexpr double kMaxStrokeTurns = 4;
/// Structure after a reversal takes this share of the usual time to the next one, or all of it.
constexpr std::array kReversalShares{1.0, 0.25, 0.06};

double value_at_share(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, place);
  return *place;
}

std::vector<double> loads_Nm(const model::effects::EffectChain& chain, const Signals& s) {
  std::vector<double> loads(s.size());
  for (std::size_t i = 0; i < s.size(); ++i) loads[i] = std::abs(chain.load_Nm(s.position_rad[i]));
  return loads;
}

}  // namespace

std::vector<EmpiricalTable> empirical_tables(const FittedModel& fitted, const Rows& rows,
                                             const std::vector<Eigen::Index>& use) {
  const auto of_rows = [&](const std::function<std::vector<double>(const Signals&)>& quantity) {
    const Eigen::VectorXd means = rows.means(quantity)(use);
    return std::vector<double>(means.data(), means.data() + means.size());
  };
  std::vector<EmpiricalTable> list;
  const auto add = [&](Along along, std::span<const Times> factors, double from, double to,
                       std::initializer_list<std::size_t> sizes) {
    if (!(to > from)) return;
    for (const Times times : factors)
      for (const std::size_t values : sizes) list.push_back({along, times, from, to, values});
  };
  constexpr std::array kOne{Times::kOne};
  constexpr std::array kDirection{Times::kDirection};
  constexpr std::array kByLoad{Times::kLoad};
  constexpr std::array kOfPosition{Times::kOne, Times::kDirection, Times::kVelocity};

  const std::vector<double> velocity = of_rows([](const Signals& s) { return s.velocity_rad_per_s; });
  const double slowest = value_at_share(velocity, kBeyond);
  const double fastest = value_at_share(velocity, 1 - kBeyond);
  add(Along::kVelocity, kOne, slowest, fastest, {9, 17, 33});

  const std::vector<double> position = of_rows([](const Signals& s) { return s.position_rad; });
  const double low = value_at_share(position, kBeyond);
  const double high = value_at_share(position, 1 - kBeyond);
  const bool turns = widest_span_rad(rows.signals()) > kTurnsToRepeat * kTurn_rad;
  if (turns) add(Along::kTurn, kOfPosition, 0, kTurn_rad, {12, 24, 48});
  if (high - low < kMaxStrokeTurns * kTurn_rad) add(Along::kPosition, kOfPosition, low, high, {9, 17, 33});

  const model::effects::EffectChain chain(fitted.model.effects);
  const std::vector<double> load = of_rows([&](const Signals& s) { return loads_Nm(chain, s); });
  const double heaviest = value_at_share(load, 1 - kBeyond);
  if (heaviest - value_at_share(load, kBeyond) > 0.05 * heaviest) {
    add(Along::kLoad, kDirection, 0, heaviest, {3, 7});
    add(Along::kVelocity, kByLoad, slowest, fastest, {5, 9});
  }
  const double usual =
      value_at_share(of_rows([](const Signals& s) { return s.since_reversal_s; }), 1 - kBeyond);
  for (const double share : kReversalShares)
    add(Along::kSinceReversal, kDirection, 0, share * usual, {6, 12});
  return list;
}

Eigen::MatrixXd columns_of(const EmpiricalTable& table, const FittedModel& fitted, const Rows& rows) {
  const EvenTable zero = table.with(std::vector<double>(table.values));
  const model::effects::EffectChain chain(fitted.model.effects);
  Eigen::MatrixXd columns(rows.count(), static_cast<Eigen::Index>(table.values));
  in_parallel(table.values, [&](std::size_t k) {
    columns.col(static_cast<Eigen::Index>(k)) = rows.column([&](const Signals& s) {
      const std::vector<double> load = table.along == Along::kLoad || table.times == Times::kLoad
                                           ? loads_Nm(chain, s)
                                           : std::vector<double>{};
      const auto share_at = [&](double x) {
        const EvenTable::Between place = zero.between(x);
        return (place.lower == k ? 1 - place.share : 0) + (place.upper == k ? place.share : 0);
      };
      std::vector<double> torque(s.size());
      for (std::size_t i = 0; i < s.size(); ++i) {
        const double forward = 0.5 + 0.5 * s.direction[i];
        const double speed = std::abs(s.velocity_rad_per_s[i]);
        const double at = table.along == Along::kLoad            ? load[i]
                          : table.along == Along::kSinceReversal ? s.since_reversal_s[i]
                                                                 : s.position_rad[i];
        switch (table.times) {
          case Times::kOne:
            torque[i] = table.along == Along::kVelocity
                            ? forward * share_at(speed) + (1 - forward) * share_at(-speed)
                            : share_at(at);
            break;
          case Times::kDirection: torque[i] = s.direction[i] * share_at(at); break;
          case Times::kVelocity: torque[i] = s.direction[i] * speed * share_at(at); break;
          case Times::kLoad:
            torque[i] = load[i] * (forward * share_at(speed) - (1 - forward) * share_at(-speed));
            break;
        }
      }
      return torque;
    });
  });
  return columns;
}

}  // namespace identification::gap
