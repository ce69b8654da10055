/// @file
/// Several requests under way to one module at once, for a carrier that queues them.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/tmcl/request_queue.h"
#include "drivers/tmcl/transport.h"

namespace drivers::tmcl {

/// The TMCL manual allows one request at a time. A module on CAN that buffers frames answers them in order,
/// and then a batch costs one round trip instead of one per request. But no reply names its parameter, so
/// after a dropped request the next answer would be misinterpreted. Therefore answers are returned only once
/// the whole batch has been answered in order; otherwise all of it is dropped, and nothing is sent until late
/// replies have had time to arrive. Cycle: all of it. One thread.
///
///   batch.step(transport);                                    // each cycle, first
///   for (const Completion& done : batch.take()) ...           // empty until all have come
///   if (batch.free()) { batch.post(transport, a); batch.post(transport, b); }
class RequestBatch {
 public:
  static constexpr std::size_t kCapacity = 8;

  /// A batch is dropped if it is not fully answered by the step() of this number; the pause after it is
  /// equally long. @param patience at least 1
  explicit RequestBatch(int patience) noexcept : patience_(patience) {}

  /// Reads the replies that have arrived.
  void step(Transport& transport) noexcept;
  /// The answered batch, in the order of posting: done or refused. Valid until the next post().
  std::span<const Completion> take() noexcept;

  /// Nothing is under way, and no late reply is expected.
  bool free() const noexcept { return size_ == 0 && pause_ == 0; }
  /// Adds to the batch. False if the transport does not take it. Allowed while not free(), for urgent
  /// requests such as a motor stop: then it may be lost, and its answer unseen.
  bool post(Transport& transport, const Request& request) noexcept;

  /// Number of dropped batches.
  std::uint64_t lost() const noexcept { return lost_; }

 private:
  void give_up() noexcept;

  std::array<Completion, kCapacity> entries_{};
  std::size_t size_ = 0;
  std::size_t answered_ = 0;
  int patience_;
  int waited_ = 0;
  int pause_ = 0;
  std::uint64_t lost_ = 0;
};

}  // namespace drivers::tmcl
