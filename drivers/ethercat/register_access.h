/// @file
/// Slave registers during set-up: batches, retries, errors with context.
#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <span>

#include "drivers/ethercat/transceiver.h"

namespace drivers::ethercat {

/// Setup only. A lost frame is repeated a few times before it is an error; another master on the bus is an
/// error at once.
class RegisterAccess {
 public:
  struct Options {
    /// Nothing is driven yet, so both are generous: a busy machine that simulates the slaves often answers
    /// after 60 ms, and sometimes after more than 300 ms.
    std::chrono::nanoseconds frame_timeout = std::chrono::milliseconds(100);
    int tries = 10;
  };
  RegisterAccess(Transceiver& transceiver, const Options& options)
      : transceiver_(transceiver), options_(options) {}

  /// Reads or writes all slaves with one datagram; returns the number that answered.
  /// @throws BusError if no frame comes back.
  std::uint16_t broadcast_read(std::uint16_t address, std::span<std::uint8_t> data);
  std::uint16_t broadcast_write(std::uint16_t address, std::span<const std::uint8_t> data);

  /// One datagram for each i of 0 … count − 1, as many per frame as fit. `add(writer, index, i)` returns
  /// false if it did not fit; it returns true without adding if `skip(i)` is true. `take(datagram, i)` gets
  /// each answer.
  void each(std::size_t count, const std::function<bool(std::size_t)>& skip,
            const std::function<bool(FrameWriter&, std::uint8_t, std::size_t)>& add,
            const std::function<void(const Datagram&, std::size_t)>& take);

  /// @throws AnotherMaster while one is active.
  void require_no_other_master() const;

 private:
  void exchange_or_throw(const std::function<void(FrameWriter&, std::uint8_t)>& fill);

  Transceiver& transceiver_;
  Options options_;
};

}  // namespace drivers::ethercat
