#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "tests/faults/kinds.h"

namespace faults {
namespace {

using namespace std::chrono_literals;
using sim::bus::BoardFault;
using support::BoardInputs;
using support::LyingBoard;

/// A board's flag reaches the daemon in a period, and its answer the board in another.
constexpr auto kFlag = 10ms;

using MakeLie = Lie (*)(World& world, const Event& event);

Kind lies(std::string_view name, MakeLie make) {
  return {
      .name = name,
      .where = Kind::Where::kJoint,
      .longest = 3000ms,
      .strikes = "inputs",
      .make_lie = make,
      .begin = [](World& world,
                  const Event& event) { world.board(event.place).lie(event.kind->make_lie(world, event)); },
      .end = [](World& world, const Event& event) { world.board(event.place).tell_truth(); }};
}

std::int32_t scaled(std::int32_t begin, std::int32_t now, double factor) {
  return begin + static_cast<std::int32_t>(std::lround(factor * (static_cast<double>(now) - begin)));
}

/// Position and velocity alike, as an encoder with another number of lines.
Lie encoder_times(double factor) {
  return [factor](const BoardInputs& begin, const BoardInputs& now) {
    BoardInputs shown = now;
    shown.position = scaled(begin.position, now.position, factor);
    shown.velocity = static_cast<std::int32_t>(std::lround(factor * now.velocity));
    return shown;
  };
}

template <BoardFault Fault>
Kind board_fault(std::string_view name) {
  return {.name = name,
          .where = Kind::Where::kJoint,
          .longest = 3000ms,
          .last_torque_after = Fault == BoardFault::kStuckEncoder ? 0ms : std::chrono::milliseconds(kFlag),
          .begin = [](World& world,
                      const Event& event) { world.emulation().slave(event.place).set_fault(Fault, true); },
          .end = [](World& world,
                    const Event& event) { world.emulation().slave(event.place).set_fault(Fault, false); }};
}

Kind falls_to(std::string_view name, void (*fall)(World&, const Event&)) {
  return {.name = name, .where = Kind::Where::kJoint, .begin = fall};
}

std::vector<Kind> sensor_kinds() {
  return {
      lies("encoder-frozen", [](World&, const Event&) { return encoder_times(0); }),
      lies("encoder-half", [](World&, const Event&) { return encoder_times(0.5); }),
      lies("encoder-double", [](World&, const Event&) { return encoder_times(2); }),
      lies("encoder-reversed", [](World&, const Event&) { return encoder_times(-1); }),
      lies("encoder-loses-counts",
           [](World&, const Event& event) { return encoder_times(0.7 + 0.3 * event.size); }),
      lies("board-frozen",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs& begin, const BoardInputs& now) {
               BoardInputs shown = begin;
               shown.flags = now.flags;
               return shown;
             };
           }),
      lies("board-frozen-whole",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs& begin, const BoardInputs&) { return begin; };
           }),
      lies("position-frozen",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs& begin, BoardInputs now) {
               now.position = begin.position;
               return now;
             };
           }),
      lies("position-jumps",
           [](World&, const Event& event) -> Lie {
             const auto jump = static_cast<std::int32_t>(1e3 * std::pow(10, 4 * event.size));
             return [jump](const BoardInputs&, BoardInputs now) {
               now.position += jump;
               return now;
             };
           }),
      lies("position-noisy",
           [](World& world, const Event& event) -> Lie {
             const auto random = std::make_shared<std::mt19937_64>(world.random()());
             const double noise = 3000 * event.size;
             return [random, noise](const BoardInputs&, BoardInputs now) {
               now.position += static_cast<std::int32_t>(std::normal_distribution<>(0, 1 + noise)(*random));
               return now;
             };
           }),
      lies("position-drifts",
           [](World&, const Event& event) -> Lie {
             const auto drift = std::make_shared<std::int32_t>(0);
             const auto step = static_cast<std::int32_t>(1 + 60 * event.size);
             return [drift, step](const BoardInputs&, BoardInputs now) {
               now.position += * drift += step;
               return now;
             };
           }),
      lies("position-delayed",
           [](World&, const Event& event) -> Lie {
             const auto past = std::make_shared<std::deque<BoardInputs>>();
             const auto periods = static_cast<std::size_t>(3 + 60 * event.size);
             return [past, periods](const BoardInputs&, const BoardInputs& now) {
               past->push_back(now);
               BoardInputs shown = past->front();
               if (past->size() > periods) past->pop_front();
               shown.flags = now.flags;
               return shown;
             };
           }),
      lies("position-pauses",
           [](World&, const Event& event) -> Lie {
             // Constant in every second interval, and true in between.
             const auto held = std::make_shared<BoardInputs>();
             const auto cycle = std::make_shared<int>(0);
             const int interval = 2 + static_cast<int>(38 * event.size);
             return [held, cycle, interval](const BoardInputs&, BoardInputs now) {
               if ((*cycle)++ / interval % 2 == 0) *held = now;
               now.position = held->position;
               return now;
             };
           }),
      lies("position-bit-flips",
           [](World& world, const Event& event) -> Lie {
             // In single samples.
             const auto random = std::make_shared<std::mt19937_64>(world.random()());
             const std::uint32_t bit = 1U << static_cast<unsigned>(31.99 * event.size);
             return [random, bit](const BoardInputs&, BoardInputs now) {
               if ((*random)() % 50 == 0)
                 now.position = static_cast<std::int32_t>(static_cast<std::uint32_t>(now.position) ^ bit);
               return now;
             };
           }),
      lies("position-slips",
           [](World&, const Event& event) -> Lie {
             // By an electrical revolution of the motor, which Hall sensors do not see.
             constexpr std::int32_t kRevolution = 500;
             const auto cycle = std::make_shared<int>(0);
             const int interval = 20 + static_cast<int>(500 * event.size);
             return [cycle, interval](const BoardInputs&, BoardInputs now) {
               now.position -= kRevolution * (1 + (*cycle)++ / interval);
               return now;
             };
           }),
      lies("position-reading-absurd",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs&, BoardInputs now) {
               now.position = std::numeric_limits<std::int32_t>::min();
               return now;
             };
           }),
      lies("encoder-fades",
           [](World&, const Event& event) -> Lie {
             // Its gain falls within 2 s.
             struct Fading {
               double gain = 1.0;
               double shown = 0.0;
               std::int32_t last = 0;
               bool begun = false;
             };
             const auto fading = std::make_shared<Fading>();
             const double least = 0.7 * event.size;
             return [fading, least](const BoardInputs& begin, BoardInputs now) {
               Fading& f = *fading;
               if (!std::exchange(f.begun, true)) {
                 f.shown = begin.position;
                 f.last = begin.position;
               }
               f.gain = std::max(least, f.gain - (1 - least) / 2000);
               f.shown += f.gain * (static_cast<double>(now.position) - std::exchange(f.last, now.position));
               now.position = static_cast<std::int32_t>(std::lround(f.shown));
               now.velocity = static_cast<std::int32_t>(std::lround(f.gain * now.velocity));
               return now;
             };
           }),
      lies("velocity-delayed",
           [](World&, const Event& event) -> Lie {
             const auto past = std::make_shared<std::deque<std::int32_t>>();
             const auto periods = static_cast<std::size_t>(10 + 200 * event.size);
             return [past, periods](const BoardInputs&, BoardInputs now) {
               past->push_back(now.velocity);
               now.velocity = past->front();
               if (past->size() > periods) past->pop_front();
               return now;
             };
           }),
      lies("velocity-frozen",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs& begin, BoardInputs now) {
               now.velocity = begin.velocity;
               return now;
             };
           }),
      lies("velocity-zero",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs&, BoardInputs now) {
               now.velocity = 0;
               return now;
             };
           }),
      lies("velocity-reversed",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs&, BoardInputs now) {
               now.velocity = -now.velocity;
               return now;
             };
           }),
      lies("velocity-reading-absurd",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs&, BoardInputs now) {
               now.velocity = std::numeric_limits<std::int32_t>::min();
               return now;
             };
           }),
      lies("current-frozen",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs& begin, BoardInputs now) {
               now.current = begin.current;
               return now;
             };
           }),
      lies("current-reading-absurd",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs&, BoardInputs now) {
               now.current = std::numeric_limits<std::int32_t>::min();
               return now;
             };
           }),
      lies("current-zero",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs&, BoardInputs now) {
               now.current = 0;
               return now;
             };
           }),
      lies("current-reversed",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs&, BoardInputs now) {
               now.current = -now.current;
               return now;
             };
           }),
      lies("current-offset",
           [](World&, const Event& event) -> Lie {
             const auto offset = static_cast<std::int32_t>(3000 * event.size);
             return [offset](const BoardInputs&, BoardInputs now) {
               now.current += offset;
               return now;
             };
           }),
      lies("inputs-zero",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs&, const BoardInputs&) { return BoardInputs{}; };
           }),
      lies("inputs-all-ones",
           [](World&, const Event&) -> Lie {
             return [](const BoardInputs&, const BoardInputs&) {
               return BoardInputs{-1, -1, -1, std::numeric_limits<std::uint32_t>::max()};
             };
           }),
      lies("inputs-random",
           [](World& world, const Event&) -> Lie {
             const auto random = std::make_shared<std::mt19937_64>(world.random()());
             return [random](const BoardInputs&, const BoardInputs&) {
               const auto any = [&] { return static_cast<std::int32_t>((*random)()); };
               return BoardInputs{any(), any(), any(), static_cast<std::uint32_t>(any())};
             };
           }),
      lies("flags-random",
           [](World& world, const Event&) -> Lie {
             const auto random = std::make_shared<std::mt19937_64>(world.random()());
             return [random](const BoardInputs&, BoardInputs now) {
               now.flags ^= static_cast<std::uint32_t>((*random)()) & 0x3FFFFU;
               return now;
             };
           }),
      lies("encoder-of-another-joint",
           [](World& world, const Event& event) -> Lie {
             LyingBoard* const other = &world.board((event.place + 1) % world.joints());
             const std::int32_t offset = world.board(event.place).truth().position - other->truth().position;
             return [other, offset](const BoardInputs&, BoardInputs now) {
               now.position = other->truth().position + offset;
               now.velocity = other->truth().velocity;
               return now;
             };
           }),
  };
}

}  // namespace

std::vector<Kind> board_kinds() {
  std::vector<Kind> kinds = sensor_kinds();
  const std::vector<Kind> others{
      {.name = "slave-off",
       .where = Kind::Where::kSlave,
       .longest = 3000ms,
       .last_torque_after = kLoss,
       .strikes = "slaves",
       .begin = [](World& world,
                   const Event& event) { world.emulation().bus().set_power(event.place, false); },
       .end = [](World& world, const Event& event) { world.emulation().bus().set_power(event.place, true); }},
      {.name = "brown-out",
       .longest = 3000ms,
       .last_torque_after = kLoss,
       .strikes = "slaves",
       .begin =
           [](World& world, const Event&) {
             for (std::size_t slave = 0; slave < world.emulation().bus().size(); ++slave)
               world.emulation().bus().set_power(slave, false);
           },
       .end =
           [](World& world, const Event&) {
             for (std::size_t slave = 0; slave < world.emulation().bus().size(); ++slave)
               world.emulation().bus().set_power(slave, true);
           }},
      {.name = "firmware-restarts",
       .where = Kind::Where::kSlave,
       .strikes = "slaves",
       .begin =
           [](World& world, const Event& event) {
             world.emulation().bus().set_power(event.place, false);
             world.emulation().bus().set_power(event.place, true);
           }},
      falls_to(
          "falls-to-safe-op",
          [](World& world, const Event& event) {
            world.emulation().slave(event.place).report_error(drivers::ethercat::AlState::kSafeOp, 0x001B);
          }),
      falls_to(
          "falls-to-pre-op",
          [](World& world, const Event& event) {
            world.emulation().slave(event.place).report_error(drivers::ethercat::AlState::kPreOp, 0x0018);
          }),
      falls_to("falls-to-init",
               [](World& world, const Event& event) {
                 world.emulation().slave(event.place).report_error(drivers::ethercat::AlState::kInit, 0x0016);
               }),
      {.name = "mailbox-hangs",
       .where = Kind::Where::kJoint,
       .longest = 3000ms,
       .begin = [](World& world,
                   const Event& event) { world.emulation().slave(event.place).hang_mailbox(true); },
       .end = [](World& world,
                 const Event& event) { world.emulation().slave(event.place).hang_mailbox(false); }},
      {.name = "unrequested-mail",
       .where = Kind::Where::kJoint,
       .begin =
           [](World& world, const Event& event) {
             std::array<std::uint8_t, 12> garbage{};
             for (std::uint8_t& byte : garbage) byte = static_cast<std::uint8_t>(world.random()());
             (void)world.emulation().slave(event.place).post_mailbox(garbage);
           }},
      {.name = "encoder-glitches",
       .where = Kind::Where::kJoint,
       .longest = 3000ms,
       .begin = [](World& world,
                   const Event& event) { world.emulation().board(event.place).set_encoder_glitches(true); },
       .end = [](World& world,
                 const Event& event) { world.emulation().board(event.place).set_encoder_glitches(false); }},
      board_fault<BoardFault::kStuckEncoder>("encoder-really-stuck"),
      board_fault<BoardFault::kHallSensor>("hall-sensor"),
      board_fault<BoardFault::kUndervoltage>("undervoltage"),
      board_fault<BoardFault::kOvervoltage>("overvoltage"),
      board_fault<BoardFault::kOvertemperature>("overtemperature"),
  };
  kinds.insert(kinds.end(), others.begin(), others.end());
  return kinds;
}

}  // namespace faults
