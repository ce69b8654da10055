#include "drivers/ethercat/lock_step_link.h"

#include <array>
#include <cerrno>
#include <utility>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/frame.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/simulated_bus.h"
#include "drivers/ethercat/transceiver.h"

namespace drivers::ethercat {

using std::chrono::nanoseconds;

namespace {
constexpr std::size_t kIndexOffset = kFrameHeaderBytes + 1;
}  // namespace

LockStepLink::LockStepLink(std::unique_ptr<Link> link, bool lifted) : link_(std::move(link)) {
  PreOpBus bus(*this, nullptr, {});
  if (const Slave* const slave = first_without(kLockStepMark, bus.slaves()))
    throw BusError(slave->label(), "check that it is simulated in lock-step",
                   "it is not; only youbot-sim --lock-step runs in virtual time");
  const std::array<std::uint8_t, 1> place{lifted};
  bus.broadcast_write(kLiftedAddress, place);
}

bool LockStepLink::send(std::span<const std::uint8_t> frame) noexcept {
  now_ += kLockStepPeriod;  // also for a refused frame, so that time-outs above the link end
  under_way_ = gone_ == 0 && link_->send(frame);
  if (!under_way_ && gone_ == 0) gone_ = link_->last_error();
  index_ = frame[kIndexOffset];
  return under_way_;
}

std::size_t LockStepLink::receive(std::span<std::uint8_t> buffer, nanoseconds timeout) noexcept {
  if (!under_way_) {
    wait(timeout);
    return 0;
  }
  const std::size_t size = link_->receive(buffer, kLockStepPatience);
  if (size == 0) gone_ = ETIME;
  under_way_ = size > kIndexOffset && buffer[kIndexOffset] != index_;
  return size;
}

void LockStepLink::wait(nanoseconds duration) noexcept {
  const nanoseconds end = now_ + duration;
  std::array<std::uint8_t, kMaxFrameBytes> answer{};
  FrameWriter writer;
  (void)writer.add(Command::kNop, 0, 0, 0);
  while (now_ < end)
    if (send(writer.bytes()))
      for (int frames = 0; under_way_ && frames < kMaxStrangers; ++frames) (void)receive(answer, {});
}

}  // namespace drivers::ethercat
