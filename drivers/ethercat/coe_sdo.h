/// @file
/// CAN application protocol over the EtherCAT mailbox (CoE): reads and writes objects of a slave by SDO
/// (ETG.1000.6, section 5.6; mailbox ETG.1000.4, section 5.6). All little-endian:
///
///   mailbox header  length 2 (of what follows the header) | station 2 | channel, priority 1 |
///                   type 4 bits, counter 3 bits
///   CoE header      number 9 bits, reserved 3 bits, service 4 bits
///   SDO             command 1 | index 2 | subindex 1 | data or size 4 | data ...
///   SDO segment     command 1 | data of at least 7 bytes
///
/// Received bytes are never trusted: truncated or contradictory ones are kMalformed.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/ethercat/frame.h"

namespace drivers::ethercat {

struct SdoObject {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  bool complete = false;  ///< all subindices from `subindex` (0 or 1) on: "complete access"
  friend bool operator==(const SdoObject&, const SdoObject&) = default;
};
/// "0x1018:01"
std::string to_string(const SdoObject& object);

/// ETG.1000.6, table 41: 0x06020000 is "the object does not exist in the object dictionary".
const char* describe_sdo_abort(std::uint32_t code) noexcept;
/// The mailbox error reply, ETG.1000.4, table 30.
const char* describe_mailbox_error(std::uint16_t code) noexcept;

/// An unrequested report of the slave (ETG.1000.6, section 5.6.4).
struct CoeEmergency {
  std::uint16_t error_code = 0;  ///< 0: an error has ended
  std::uint8_t error_register = 0;
  std::array<std::uint8_t, 5> data{};
};
/// The class of an emergency's error code (CiA 301, table 26): 0x2310 is "current".
const char* describe_emergency(std::uint16_t error_code) noexcept;

// ---- from the slave ----

/// One mail. Only the fields of its kind are set; `data` is valid as long as the bytes it was read from.
struct CoeMail {
  enum class Kind : std::uint8_t {
    kMalformed,          ///< problem
    kMailboxError,       ///< error_code: the slave could not process the request
    kOther,              ///< another protocol, or a CoE service other than SDO
    kEmergency,          ///< emergency
    kAbort,              ///< object, error_code
    kUpload,             ///< object, size (of the object), data (all of it, or the first part)
    kUploadSegment,      ///< toggle, last, data
    kDownloaded,         ///< object
    kDownloadedSegment,  ///< toggle
  };
  Kind kind = Kind::kMalformed;
  std::uint8_t counter = 0;  ///< 1 … 7, incremented by the slave; 0 if it does not count
  SdoObject object;
  std::uint32_t error_code = 0;
  std::uint32_t size = 0;
  bool toggle = false;
  bool last = false;
  std::span<const std::uint8_t> data;
  CoeEmergency emergency;
  const char* problem = "";
};
/// `mailbox` may be longer than its mail. Cycle-safe.
CoeMail decode_coe(std::span<const std::uint8_t> mailbox) noexcept;

// ---- to the slave ----

inline constexpr std::size_t kMinCoeMailboxBytes = 16;  ///< the shortest mailbox an SDO fits in
inline constexpr std::size_t kMaxMailboxBytes = kMaxDatagramBytes;

/// Consecutive transfers with one slave; keep the object as long as the slave, for its counters. No clock and
/// no I/O:
///
///   transfer.begin_upload(object, buffer, mailbox_bytes);
///   while (transfer.under_way())
///     transfer.take(transfer.must_send() ? exchange(transfer.request()) : wait_for_mail());
///
/// Mails that answer something else (emergencies, other protocols, late replies to an abandoned transfer,
/// repetitions) are skipped. A failed transfer is not aborted on the wire: the next one resets the slave's.
/// Cycle-safe except failure(); large: it holds a whole mailbox.
class SdoTransfer {
 public:
  enum class Status : std::uint8_t { kIdle, kSend, kListen, kDone, kAborted, kFailed };

  /// `destination` must outlive the transfer. `mailbox_bytes`: length of the mailbox towards the slave.
  void begin_upload(const SdoObject& object, std::span<std::uint8_t> destination,
                    std::size_t mailbox_bytes) noexcept;
  /// `source` must outlive the transfer. Up to four bytes are sent expedited, as slaves expect for small
  /// objects.
  void begin_download(const SdoObject& object, std::span<const std::uint8_t> source,
                      std::size_t mailbox_bytes) noexcept;

  Status status() const noexcept { return status_; }
  bool under_way() const noexcept { return status_ == Status::kSend || status_ == Status::kListen; }
  bool must_send() const noexcept { return status_ == Status::kSend; }
  /// The mailbox to write, for kSend; pass its reply to take().
  std::span<const std::uint8_t> request() const noexcept { return std::span(request_).first(request_size_); }
  /// A mailbox as read from the slave.
  void take(std::span<const std::uint8_t> mailbox) noexcept;

  std::size_t transferred() const noexcept { return transferred_; }  ///< bytes
  std::uint32_t abort_code() const noexcept { return error_code_; }  ///< for kAborted
  unsigned emergencies() const noexcept { return emergencies_; }     ///< in this transfer
  const CoeEmergency& last_emergency() const noexcept { return last_emergency_; }
  /// Setup: text for kAborted and kFailed, with the last emergency during the transfer.
  std::string failure() const;

 private:
  void begin(const SdoObject& object, std::size_t mailbox_bytes) noexcept;
  std::uint8_t* start_request(std::size_t bytes) noexcept;
  void request_initiate(std::uint8_t command, std::size_t bytes) noexcept;
  void request_upload_segment() noexcept;
  void request_download_segment() noexcept;
  bool is_repetition(const CoeMail& mail) noexcept;
  void take_upload(const CoeMail& mail) noexcept;
  void take_upload_data(std::span<const std::uint8_t> data) noexcept;
  void take_upload_segment(const CoeMail& mail) noexcept;
  void take_downloaded() noexcept;
  void take_downloaded_segment(const CoeMail& mail) noexcept;
  void skip() noexcept;
  void fail(const char* problem) noexcept;

  /// The expected kind of reply.
  enum class Expect : std::uint8_t { kUpload, kUploadSegment, kDownloaded, kDownloadedSegment };

  Status status_ = Status::kIdle;
  Expect expect_ = Expect::kUpload;
  SdoObject object_;
  std::span<std::uint8_t> destination_;
  std::span<const std::uint8_t> source_;
  std::size_t size_ = 0;
  std::size_t transferred_ = 0;
  std::size_t mailbox_bytes_ = 0;
  bool toggle_ = false;
  std::uint32_t error_code_ = 0;
  const char* problem_ = nullptr;  // null: the slave's mailbox error `error_code_`
  unsigned skipped_ = 0;
  unsigned emergencies_ = 0;
  CoeEmergency last_emergency_;
  std::uint8_t counter_ = 0;        // of the last request
  std::uint8_t slave_counter_ = 0;  // of the last mail
  bool slave_counts_ = false;       // some slaves never change theirs
  std::size_t request_size_ = 0;
  std::array<std::uint8_t, kMaxMailboxBytes> request_{};
};

}  // namespace drivers::ethercat
