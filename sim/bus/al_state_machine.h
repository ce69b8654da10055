/// @file
/// The state machine of a slave's application layer (ETG.1000.6 section 6.4, ETG.1020).
#pragma once
#include <chrono>
#include <cstdint>

#include "drivers/ethercat/al_status.h"

namespace sim::bus {

/// AL status codes of the emulated slaves (ETG.1000.6, table 11); their texts are in
/// drivers::ethercat::describe_al_status_code().
namespace al_code {
inline constexpr std::uint16_t kNone = 0x0000;
inline constexpr std::uint16_t kInvalidStateChange = 0x0011;
inline constexpr std::uint16_t kUnknownState = 0x0012;
inline constexpr std::uint16_t kNoBootstrap = 0x0013;
inline constexpr std::uint16_t kInvalidMailbox = 0x0016;
inline constexpr std::uint16_t kInvalidSyncManager = 0x0017;
inline constexpr std::uint16_t kNoValidOutputs = 0x0019;
inline constexpr std::uint16_t kWatchdog = 0x001B;
inline constexpr std::uint16_t kInvalidOutputs = 0x001D;
inline constexpr std::uint16_t kInvalidInputs = 0x001E;
}  // namespace al_code

/// Rules:
/// - A refused request keeps the state, sets the error bit and the code.
/// - While the error bit is set, a request without acknowledge (0x10) is only accepted to a lower state, and
///   then clears the error; others are ignored. With acknowledge, error and code are cleared, then the
///   request is processed as usual.
/// - SAFE-OP to OP waits for the first complete outputs of the master after SAFE-OP was entered, stays in
///   SAFE-OP without error meanwhile, and is refused with 0x0019 at the time-out.
class AlStateMachine {
 public:
  using AlState = drivers::ethercat::AlState;

  AlState state() const noexcept { return state_; }
  std::uint16_t code() const noexcept { return code_; }
  /// Register 0x0130.
  std::uint16_t status() const noexcept;

  void reset() noexcept { *this = AlStateMachine{}; }
  /// AL control was written. `obstacle`: objection of the slave's configuration to the requested state; 0:
  /// none. `outputs_time`: how long to wait for outputs on the way to OP.
  void request(std::uint16_t control, std::uint16_t obstacle, bool outputs_valid,
               std::chrono::nanoseconds outputs_time) noexcept;
  void advance(std::chrono::nanoseconds step) noexcept;
  /// The master wrote outputs: completes a waiting SAFE-OP to OP.
  void outputs_arrived() noexcept;
  /// The slave leaves its state by itself.
  void fall_back(AlState state, std::uint16_t code) noexcept;

  static constexpr AlState requested_state(std::uint16_t control) noexcept {
    return static_cast<AlState>(control & 0x0F);
  }

 private:
  void refuse(std::uint16_t code) noexcept;
  void enter(AlState state) noexcept;

  AlState state_ = AlState::kInit;
  std::uint16_t code_ = al_code::kNone;
  bool error_ = false;
  bool waiting_ = false;  // for outputs
  std::chrono::nanoseconds wait_left_{};
};

}  // namespace sim::bus
