#include "drivers/usb/libusb_port.h"

#include <libusb-1.0/libusb.h>

#include <algorithm>
#include <new>
#include <utility>

#include "drivers/usb/libusb_time.h"

namespace drivers::usb {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

constexpr auto kControlTimeout = 1s;
constexpr auto kReturnTimeout = 1s;        // for a cancelled transfer
constexpr std::size_t kWritePiece = 4096;  // a multiple of every packet size
constexpr std::uint8_t kVendorRequestOut = 0x40;
constexpr unsigned kPacketSizeBits = 0x7FF;  // of wMaxPacketSize

TransferResult result_of(const libusb_transfer& transfer) noexcept {
  const auto size = static_cast<std::size_t>(std::max(transfer.actual_length, 0));
  switch (transfer.status) {
    case LIBUSB_TRANSFER_COMPLETED: return {TransferStatus::kDone, size, 0};
    case LIBUSB_TRANSFER_TIMED_OUT:
    case LIBUSB_TRANSFER_CANCELLED: return {TransferStatus::kTimeout, size, LIBUSB_ERROR_TIMEOUT};
    case LIBUSB_TRANSFER_STALL: return {TransferStatus::kStalled, size, LIBUSB_ERROR_PIPE};
    case LIBUSB_TRANSFER_NO_DEVICE: return {TransferStatus::kUnplugged, size, LIBUSB_ERROR_NO_DEVICE};
    case LIBUSB_TRANSFER_OVERFLOW: return {TransferStatus::kOther, size, LIBUSB_ERROR_OVERFLOW};
    case LIBUSB_TRANSFER_ERROR: break;
  }
  return {TransferStatus::kOther, size, LIBUSB_ERROR_IO};
}

TransferResult result_of(int error) noexcept {
  switch (error) {
    case LIBUSB_ERROR_NO_DEVICE: return {TransferStatus::kUnplugged, 0, error};
    case LIBUSB_ERROR_PIPE: return {TransferStatus::kStalled, 0, error};
    case LIBUSB_ERROR_TIMEOUT: return {TransferStatus::kTimeout, 0, error};
    default: return {TransferStatus::kOther, 0, error};
  }
}

constexpr std::size_t kControlBegin = 0;
constexpr std::size_t kOutBegin = kControlBegin + LIBUSB_CONTROL_SETUP_SIZE;
constexpr std::size_t kInBegin = kOutBegin + kWritePiece;

/// Opens the wanted device from the list. NO_DEVICE if it is gone.
int open_device(const UsbContext& context, const UsbDevice& wanted, libusb_device_handle*& opened) {
  libusb_device** list = nullptr;
  const auto count = libusb_get_device_list(context.get(), &list);
  int error = LIBUSB_ERROR_NO_DEVICE;
  for (auto i = 0; i < count; ++i) {
    const UsbDevice device = context.inspect(list[i]);
    if (device.bus != wanted.bus || device.address != wanted.address || ids_of(device) != ids_of(wanted))
      continue;
    error = libusb_open(list[i], &opened);
    break;
  }
  if (count >= 0) libusb_free_device_list(list, 1);
  return error;
}

/// libusb's error, explained by the observable facts.
Refusal refusal(const UsbContext& context, const UsbDevice& device, const UsbPipes& pipes,
                const std::string& rules_file, const std::string& step, int error) {
  AccessFacts facts = collect_access_facts(context, device, pipes.interface, rules_file);
  facts.claim_refused = error == LIBUSB_ERROR_BUSY;
  const AccessVerdict verdict = judge_access(facts);
  const std::string code = std::string(" (") + libusb_error_name(error) + ")";
  if (verdict.access != Access::kFree)
    return {name_of(device), step, "access", verdict.found + code, verdict.hint};
  return {name_of(device), step, "access", verdict.found + ", but the kernel refused" + code,
          "in a container, allow character devices of major number 189; otherwise unplug the device, plug it "
          "in again and see the kernel's log (dmesg)"};
}

}  // namespace

LibusbPort::Opened LibusbPort::open(UsbContext& context, const UsbDevice& device, const UsbPipes& pipes,
                                    const std::string& rules_file) {
  const auto refused = [&](const std::string& step, int error) {
    return Opened{nullptr, refusal(context, device, pipes, rules_file, step, error)};
  };
  libusb_device_handle* opened = nullptr;
  if (const int error = open_device(context, device, opened); error != 0) return refused("open", error);
  Handle handle(opened, libusb_close);

  const int packet_bytes =
      libusb_get_max_packet_size(libusb_get_device(opened), pipes.in) & static_cast<int>(kPacketSizeBits);
  if (libusb_get_max_packet_size(libusb_get_device(opened), pipes.out) <= 0 ||
      libusb_get_max_packet_size(libusb_get_device(opened), pipes.in) <= 0 || packet_bytes == 0) {
    return {nullptr,
            {name_of(device), "look for its endpoints",
             "OUT " + std::to_string(pipes.out) + " and IN " + std::to_string(pipes.in & 0x7FU),
             "another kind of device, or one that is not configured",
             "unplug it and plug it in again; \"youbot-bench usb-probe --all\" lists what it has"}};
  }
  // Only if there is one: otherwise libusb would give the interface to a driver that did not have it.
  if (libusb_kernel_driver_active(opened, pipes.interface) == 1)
    (void)libusb_set_auto_detach_kernel_driver(opened, 1);
  if (const int error = libusb_claim_interface(opened, pipes.interface); error != 0) {
    handle.reset();  // otherwise this program would be found holding the device
    return refused("claim interface " + std::to_string(pipes.interface), error);
  }
  // Not make_unique: the constructor is private.
  std::unique_ptr<LibusbPort> port(
      new LibusbPort(context.get(), pipes, std::move(handle), static_cast<std::size_t>(packet_bytes)));
  port->listen();
  if (port->listening()) return {std::move(port), {}};
  const int error = port->unplugged_ ? LIBUSB_ERROR_NO_DEVICE : port->listen_error_;
  port.reset();
  return refused("listen to it", error);
}

LibusbPort::LibusbPort(libusb_context* context, const UsbPipes& pipes, Handle device,
                       std::size_t packet_bytes)
    : context_(context),
      pipes_(pipes),
      device_(std::move(device)),
      packet_bytes_(packet_bytes),
      buffers_(kInBegin + (kListening + kQueued) * packet_bytes),
      control_{{libusb_alloc_transfer(0), libusb_free_transfer}, this},
      out_{{libusb_alloc_transfer(0), libusb_free_transfer}, this} {
  for (std::size_t i = 0; i < kListening; ++i)
    in_.push_back({{libusb_alloc_transfer(0), libusb_free_transfer}, this});
  if (!control_.usb || !out_.usb ||
      !std::ranges::all_of(in_, [](const Transfer& t) { return t.usb != nullptr; }))
    throw std::bad_alloc();

  const auto came_back = [](libusb_transfer* usb) noexcept {
    static_cast<Transfer*>(usb->user_data)->away = false;
  };
  const auto came_in = [](libusb_transfer* usb) noexcept {
    Transfer& transfer = *static_cast<Transfer*>(usb->user_data);
    transfer.away = false;
    transfer.port->received(transfer);
  };
  constexpr unsigned kNoTimeout = 0;  // run() applies our time-outs
  libusb_fill_control_transfer(control_.usb.get(), device_.get(), &buffers_[kControlBegin], came_back,
                               &control_, kNoTimeout);
  libusb_fill_bulk_transfer(out_.usb.get(), device_.get(), pipes.out, &buffers_[kOutBegin], 0, came_back,
                            &out_, kNoTimeout);
  for (std::size_t i = 0; i < kListening; ++i) {
    libusb_fill_bulk_transfer(in_[i].usb.get(), device_.get(), pipes.in,
                              &buffers_[kInBegin + i * packet_bytes], static_cast<int>(packet_bytes), came_in,
                              &in_[i], kNoTimeout);
  }
}

LibusbPort::~LibusbPort() {
  failed_ = true;  // returning transfers stay here
  std::array<Transfer*, 2 + kListening> all{&control_, &out_};
  for (std::size_t i = 0; i < kListening; ++i) all[2 + i] = &in_[i];
  for (Transfer* const transfer : all) {
    if (transfer->away) (void)libusb_cancel_transfer(transfer->usb.get());
  }
  const nanoseconds deadline = now() + kReturnTimeout;
  for (const Transfer* const transfer : all) (void)wait_for_return(*transfer, deadline - now());
  (void)libusb_release_interface(device_.get(), pipes_.interface);
  // Before the transfers are freed: the kernel releases what it still holds.
  device_.reset();
}

nanoseconds LibusbPort::now() noexcept { return std::chrono::steady_clock::now().time_since_epoch(); }

std::span<std::uint8_t> LibusbPort::queue_slot(std::size_t index) noexcept {
  return std::span(buffers_).subspan(kInBegin + (kListening + index) * packet_bytes_, packet_bytes_);
}

// ---- transfers ----

int LibusbPort::submit(Transfer& transfer) noexcept {
  const int error = libusb_submit_transfer(transfer.usb.get());
  transfer.away = error == 0;
  if (error == LIBUSB_ERROR_NO_DEVICE) unplugged_ = true;
  return error;
}

bool LibusbPort::handle_events(nanoseconds timeout) noexcept {
  timeval wait = libusb_time(timeout);
  const int error = libusb_handle_events_timeout_completed(context_, &wait, nullptr);
  if (error == 0 || error == LIBUSB_ERROR_INTERRUPTED) return true;
  listen_error_ = error;
  return false;
}

/// Handles events at least once.
bool LibusbPort::wait_for_return(const Transfer& transfer, nanoseconds timeout) noexcept {
  const nanoseconds deadline = now() + timeout;
  while (transfer.away) {
    const nanoseconds left = deadline - now();
    if (!handle_events(left) || left <= 0ns) break;
  }
  return !transfer.away;
}

/// Submits, and waits for its return.
TransferResult LibusbPort::run(Transfer& transfer, nanoseconds timeout) noexcept {
  if (unplugged_) return result_of(LIBUSB_ERROR_NO_DEVICE);
  // A transfer that could not be cancelled the last time may have returned meanwhile.
  if (!wait_for_return(transfer, 0ns)) return result_of(LIBUSB_ERROR_BUSY);
  if (const int error = submit(transfer); error != 0) return result_of(error);
  if (!wait_for_return(transfer, timeout)) {
    (void)libusb_cancel_transfer(transfer.usb.get());
    if (!wait_for_return(transfer, kReturnTimeout)) return result_of(LIBUSB_ERROR_TIMEOUT);
  }
  // It may have finished in the moment of its cancellation: then the bytes were transferred.
  const TransferResult result = result_of(*transfer.usb);
  if (result.status == TransferStatus::kUnplugged) unplugged_ = true;
  return result;
}

int LibusbPort::clear_halt(std::uint8_t endpoint) noexcept {
  const int error = libusb_clear_halt(device_.get(), endpoint);
  if (error == LIBUSB_ERROR_NO_DEVICE) unplugged_ = true;
  return error;
}

// ---- host to device ----

TransferResult LibusbPort::control_out(std::uint8_t request, std::uint16_t value,
                                       std::uint16_t index) noexcept {
  if (!control_.away) {
    libusb_fill_control_setup(&buffers_[kControlBegin], kVendorRequestOut, request, value, index, 0);
    control_.usb->length = LIBUSB_CONTROL_SETUP_SIZE;
  }
  return run(control_, kControlTimeout);  // the next request ends a stall of the control pipe
}

TransferResult LibusbPort::write(std::span<const std::uint8_t> bytes, nanoseconds timeout) noexcept {
  const nanoseconds deadline = now() + timeout;
  TransferResult result;
  std::size_t sent = 0;
  do {  // once also for zero bytes, which make an empty packet
    const auto piece = bytes.subspan(sent, std::min(kWritePiece, bytes.size() - sent));
    if (!out_.away) {
      std::ranges::copy(piece, &buffers_[kOutBegin]);
      out_.usb->length = static_cast<int>(piece.size());
    }
    result = run(out_, deadline - now());
    sent += result.size;
    if (result.ok() && result.size != piece.size()) result = result_of(LIBUSB_ERROR_IO);
  } while (result.ok() && sent < bytes.size());
  if (result.status == TransferStatus::kStalled) {
    if (const int error = clear_halt(pipes_.out); error != 0) result = result_of(error);
  }
  result.size = sent;
  return result;
}

// ---- device to host ----

bool LibusbPort::listening() const noexcept {
  return std::ranges::any_of(in_, [](const Transfer& transfer) { return transfer.away; });
}

/// Requests as many packets as the queue has room for.
void LibusbPort::listen() noexcept {
  auto away = static_cast<std::size_t>(
      std::ranges::count_if(in_, [](const Transfer& transfer) { return transfer.away; }));
  for (Transfer& transfer : in_) {
    if (transfer.away) continue;
    if (unplugged_ || failed_ || count_ + away >= kQueued) return;
    listen_error_ = submit(transfer);
    if (listen_error_ != 0) return;
    ++away;
  }
}

/// Called by libusb within handle_events(). listen() has reserved room.
void LibusbPort::received(Transfer& transfer) noexcept {
  const TransferResult result = result_of(*transfer.usb);
  const bool cancelled = transfer.usb->status == LIBUSB_TRANSFER_CANCELLED;
  if (result.status == TransferStatus::kUnplugged) {
    unplugged_ = true;
    return;
  }
  const std::size_t place = (first_ + count_) % kQueued;
  if (result.ok() || (cancelled && result.size > 0)) {
    std::copy_n(transfer.usb->buffer, result.size, queue_slot(place).begin());
    queue_[place] = {TransferStatus::kDone, 0, result.size};
    ++count_;
  } else if (!cancelled && !failed_) {  // other pending transfers fail for the same reason
    queue_[place] = {result.status, result.code, 0};
    ++count_;
    failed_ = true;
  }
  listen();
}

/// Restarts the pipe.
TransferResult LibusbPort::recover(Arrival failure) noexcept {
  TransferResult result{failure.status, 0, failure.code};
  if (failure.status == TransferStatus::kStalled) {
    // The kernel requires that no transfer is pending at an endpoint whose halt is cleared.
    for (const Transfer& transfer : in_) {
      if (transfer.away) (void)libusb_cancel_transfer(transfer.usb.get());
    }
    const nanoseconds deadline = now() + kReturnTimeout;
    for (const Transfer& transfer : in_) (void)wait_for_return(transfer, deadline - now());
    if (const int error = clear_halt(pipes_.in); error != 0) result = result_of(error);
  }
  failed_ = false;
  listen();
  return result;
}

TransferResult LibusbPort::read(std::span<std::uint8_t> buffer, nanoseconds timeout) noexcept {
  const nanoseconds deadline = now() + timeout;
  listen();
  bool events = handle_events(0ns);
  while (count_ == 0) {
    if (unplugged_) return result_of(LIBUSB_ERROR_NO_DEVICE);
    if (!events || !listening()) return result_of(listen_error_);
    const nanoseconds left = deadline - now();
    if (left <= 0ns) return result_of(LIBUSB_ERROR_TIMEOUT);
    events = handle_events(left);
  }
  std::size_t size = 0;
  while (count_ > 0) {
    const Arrival next = queue_[first_];
    const bool failure = next.status != TransferStatus::kDone;
    if (size > 0 && (failure || next.size > buffer.size() - size)) break;
    if (!failure && next.size > buffer.size()) return result_of(LIBUSB_ERROR_INVALID_PARAM);
    const std::size_t place = std::exchange(first_, (first_ + 1) % kQueued);
    --count_;
    if (failure) return recover(next);
    std::ranges::copy(queue_slot(place).first(next.size), buffer.begin() + static_cast<std::ptrdiff_t>(size));
    size += next.size;
    if (next.size < packet_bytes_) break;  // its end would not be visible with another packet after it
  }
  listen();
  return {TransferStatus::kDone, size, 0};
}

}  // namespace drivers::usb
