#include "drivers/ethercat/coe_sdo.h"

#include <algorithm>
#include <cstdio>

namespace drivers::ethercat {
namespace {

constexpr std::size_t kMailboxHeader = 6;
constexpr std::size_t kCoeHeader = 2;
constexpr std::size_t kSdoAt = kMailboxHeader + kCoeHeader;
// Lengths as counted in the mailbox header.
constexpr std::size_t kInitiateLength = kCoeHeader + 8;
constexpr std::size_t kSegmentHeadLength = kCoeHeader + 1;
constexpr std::size_t kSmallestSegment = 7;

// Mailbox types and CoE services.
constexpr std::uint8_t kTypeError = 0;
constexpr std::uint8_t kTypeCoe = 3;
constexpr std::uint16_t kEmergency = 1;
constexpr std::uint16_t kSdoRequest = 2;
constexpr std::uint16_t kSdoResponse = 3;

// SDO commands, the upper three bits of the command byte; the lower ones depend on them.
constexpr std::uint8_t kDownloadRequest = 0x20;
constexpr std::uint8_t kUploadRequest = 0x40;
constexpr std::uint8_t kDownloadSegmentRequest = 0x00;
constexpr std::uint8_t kUploadSegmentRequest = 0x60;
constexpr std::uint8_t kUploadSegmentResponse = 0x00;
constexpr std::uint8_t kDownloadSegmentResponse = 0x20;
constexpr std::uint8_t kUploadResponse = 0x40;
constexpr std::uint8_t kDownloadResponse = 0x60;
constexpr std::uint8_t kAbort = 0x80;
constexpr std::uint8_t kSizeGiven = 0x01;
constexpr std::uint8_t kExpedited = 0x02;
constexpr std::uint8_t kCompleteAccess = 0x10;
constexpr std::uint8_t kToggle = 0x10;
constexpr std::uint8_t kLastSegment = 0x01;

/// A slave that keeps sending mail without answering must not block forever.
constexpr unsigned kMaxSkipped = 32;

CoeMail malformed(const char* problem) noexcept {
  CoeMail mail;
  mail.problem = problem;
  return mail;
}

/// `body`: from the CoE header on. Fills in the fields of the SDO.
CoeMail decode_sdo(std::span<const std::uint8_t> body, CoeMail mail) noexcept {
  if (body.size() < kSegmentHeadLength) return malformed("an SDO without a command");
  const std::uint8_t command = body[kCoeHeader];
  const std::span<const std::uint8_t> behind_command = body.subspan(kSegmentHeadLength);
  switch (command & 0xE0) {
    case kUploadSegmentResponse: {
      mail.kind = CoeMail::Kind::kUploadSegment;
      mail.toggle = (command & kToggle) != 0;
      mail.last = (command & kLastSegment) != 0;
      // The smallest segment states how many of its bytes are valid.
      const std::size_t unused =
          behind_command.size() == kSmallestSegment ? (command >> 1 & 7U) : std::size_t{0};
      mail.data = behind_command.first(behind_command.size() - unused);
      return mail;
    }
    case kDownloadSegmentResponse:
      mail.kind = CoeMail::Kind::kDownloadedSegment;
      mail.toggle = (command & kToggle) != 0;
      return mail;
    default: break;
  }
  if (behind_command.size() < 3) return malformed("an SDO without its object");
  mail.object.index = load_le<std::uint16_t>(&behind_command[0]);
  mail.object.subindex = behind_command[2];
  const std::span<const std::uint8_t> rest = behind_command.subspan(3);
  switch (command & 0xE0) {
    case kDownloadResponse: mail.kind = CoeMail::Kind::kDownloaded; return mail;
    case kAbort:
      if (rest.size() < 4) return malformed("an abort without its code");
      mail.kind = CoeMail::Kind::kAbort;
      mail.error_code = load_le<std::uint32_t>(rest.data());
      return mail;
    case kUploadResponse: {
      if (rest.size() < 4) return malformed("an upload without data");
      mail.kind = CoeMail::Kind::kUpload;
      mail.object.complete = (command & kCompleteAccess) != 0;
      if ((command & kExpedited) != 0) {
        mail.size = (command & kSizeGiven) != 0 ? 4 - (command >> 2 & 3U) : 4;
        mail.data = rest.first(mail.size);
        return mail;
      }
      if ((command & kSizeGiven) == 0) return malformed("an upload without its size");
      mail.size = load_le<std::uint32_t>(rest.data());
      mail.data = rest.subspan(4);
      if (mail.data.size() > mail.size) return malformed("an upload with more data than its size");
      return mail;
    }
    default: return malformed("an SDO command that does not exist");
  }
}

}  // namespace

std::string to_string(const SdoObject& object) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "0x%04X:%02X%s", static_cast<unsigned>(object.index),
                static_cast<unsigned>(object.subindex), object.complete ? " (complete)" : "");
  return text.data();
}

const char* describe_sdo_abort(std::uint32_t code) noexcept {
  switch (code) {
    case 0x05030000: return "toggle bit not changed";
    case 0x05040000: return "SDO protocol timeout";
    case 0x05040001: return "client/server command specifier not valid or unknown";
    case 0x05040005: return "out of memory";
    case 0x06010000: return "unsupported access to an object";
    case 0x06010001: return "attempt to read a write-only object";
    case 0x06010002: return "attempt to write a read-only object";
    case 0x06010003: return "subindex cannot be written, subindex 0 must be 0 for write access";
    case 0x06010004: return "complete access not supported for objects of variable length";
    case 0x06010005: return "object length exceeds mailbox size";
    case 0x06010006: return "object mapped to RxPDO, SDO download blocked";
    case 0x06020000: return "the object does not exist in the object dictionary";
    case 0x06040041: return "the object cannot be mapped into the PDO";
    case 0x06040042: return "number and length of the objects to be mapped would exceed the PDO length";
    case 0x06040043: return "general parameter incompatibility";
    case 0x06040047: return "general internal incompatibility in the device";
    case 0x06060000: return "access failed due to a hardware error";
    case 0x06070010: return "data type does not match, length of service parameter does not match";
    case 0x06070012: return "data type does not match, length of service parameter too high";
    case 0x06070013: return "data type does not match, length of service parameter too low";
    case 0x06090011: return "subindex does not exist";
    case 0x06090030: return "value range of parameter exceeded";
    case 0x06090031: return "value of parameter written too high";
    case 0x06090032: return "value of parameter written too low";
    case 0x06090033: return "detected module list does not match the configured one";
    case 0x06090036: return "maximum value is less than minimum value";
    case 0x08000000: return "general error";
    case 0x08000020: return "data cannot be transferred or stored to the application";
    case 0x08000021: return "data cannot be transferred or stored because of local control";
    case 0x08000022: return "data cannot be transferred or stored in the present device state";
    case 0x08000023: return "no object dictionary is present, or making one failed";
    default: return "unknown abort code";
  }
}

const char* describe_mailbox_error(std::uint16_t code) noexcept {
  switch (code) {
    case 1: return "syntax of the mailbox header is wrong";
    case 2: return "mailbox protocol not supported";
    case 3: return "channel field contains a wrong value";
    case 4: return "service of the mailbox protocol not supported";
    case 5: return "mailbox protocol header is wrong";
    case 6: return "mailbox data too short";
    case 7: return "no memory left";
    case 8: return "length of data is inconsistent";
    case 9: return "mailbox service already in use";
    default: return "unknown mailbox error";
  }
}

const char* describe_emergency(std::uint16_t error_code) noexcept {
  if (error_code >> 8 == 0xFF) return "device specific";
  if (error_code >> 8 == 0xA0) return "state transition";  // ETG.1000.6, table 50
  switch (error_code >> 12) {
    case 0x0: return error_code < 0x0100 ? "error reset, no error" : "generic error";
    case 0x1: return "generic error";
    case 0x2: return "current";
    case 0x3: return "voltage";
    case 0x4: return "temperature";
    case 0x5: return "device hardware";
    case 0x6: return "device software";
    case 0x7: return "additional modules";
    case 0x8: return "monitoring";
    case 0x9: return "external error";
    case 0xF: return "additional functions";
    default: return "unknown class";
  }
}

CoeMail decode_coe(std::span<const std::uint8_t> mailbox) noexcept {
  if (mailbox.size() < kMailboxHeader) return malformed("shorter than a mailbox header");
  const auto length = load_le<std::uint16_t>(mailbox.data());
  if (length > mailbox.size() - kMailboxHeader) return malformed("longer than its mailbox");
  const std::span<const std::uint8_t> body = mailbox.subspan(kMailboxHeader, length);
  const std::uint8_t type = mailbox[5] & 0x0F;
  CoeMail mail;
  mail.counter = mailbox[5] >> 4 & 7;
  if (type == kTypeError) {
    if (body.size() < 4) return malformed("neither mail nor a whole mailbox error");
    mail.kind = CoeMail::Kind::kMailboxError;
    mail.error_code = load_le<std::uint16_t>(&body[2]);
    return mail;
  }
  if (type != kTypeCoe) {
    mail.kind = CoeMail::Kind::kOther;
    return mail;
  }
  if (body.size() < kCoeHeader) return malformed("shorter than a CoE header");
  const unsigned service = load_le<std::uint16_t>(body.data()) >> 12;
  if (service == kEmergency) {
    if (body.size() < kInitiateLength) return malformed("an emergency that is cut off");
    mail.kind = CoeMail::Kind::kEmergency;
    mail.emergency.error_code = load_le<std::uint16_t>(&body[2]);
    mail.emergency.error_register = body[4];
    std::copy_n(&body[5], mail.emergency.data.size(), mail.emergency.data.begin());
    return mail;
  }
  // The standard defines an abort as a request from either side (ETG.1000.6, 5.6.2.7).
  const bool is_abort =
      service == kSdoRequest && body.size() >= kSegmentHeadLength && (body[kCoeHeader] & 0xE0) == kAbort;
  if (service == kSdoResponse || is_abort) return decode_sdo(body, mail);
  mail.kind = CoeMail::Kind::kOther;
  return mail;
}

void SdoTransfer::begin_upload(const SdoObject& object, std::span<std::uint8_t> destination,
                               std::size_t mailbox_bytes) noexcept {
  begin(object, mailbox_bytes);
  destination_ = destination;
  expect_ = Expect::kUpload;
  if (under_way()) request_initiate(kUploadRequest, 0);
}

void SdoTransfer::begin_download(const SdoObject& object, std::span<const std::uint8_t> source,
                                 std::size_t mailbox_bytes) noexcept {
  begin(object, mailbox_bytes);
  source_ = source;
  size_ = source.size();
  expect_ = Expect::kDownloaded;
  if (!under_way()) return;
  if (size_ > UINT32_MAX) return fail("more data than an SDO can carry");
  if (size_ >= 1 && size_ <= 4) {
    const auto unused = static_cast<std::uint8_t>((4 - size_) << 2);
    request_initiate(kDownloadRequest | kExpedited | kSizeGiven | unused, 0);
    std::copy(source.begin(), source.end(), &request_[kSdoAt + 4]);
    transferred_ = size_;
    return;
  }
  const std::size_t first = std::min(size_, mailbox_bytes_ - kMinCoeMailboxBytes);
  request_initiate(kDownloadRequest | kSizeGiven, first);
  store_le(&request_[kSdoAt + 4], static_cast<std::uint32_t>(size_));
  std::copy_n(source.begin(), first, request_.begin() + kMinCoeMailboxBytes);
  transferred_ = first;
}

void SdoTransfer::begin(const SdoObject& object, std::size_t mailbox_bytes) noexcept {
  object_ = object;
  destination_ = {};
  source_ = {};
  size_ = 0;
  transferred_ = 0;
  toggle_ = false;
  error_code_ = 0;
  skipped_ = 0;
  emergencies_ = 0;
  request_size_ = 0;
  mailbox_bytes_ = std::min(mailbox_bytes, kMaxMailboxBytes);
  status_ = Status::kSend;
  if (mailbox_bytes_ < kMinCoeMailboxBytes) fail("its mailbox is too short for CoE");
}

/// Writes the headers of a request whose SDO has `bytes` bytes; returns the start of the SDO.
std::uint8_t* SdoTransfer::start_request(std::size_t bytes) noexcept {
  // 0 is reserved. A slave treats a request with an unchanged counter as a repetition and drops it.
  counter_ = static_cast<std::uint8_t>(counter_ % 7 + 1);
  std::fill_n(request_.begin(), kSdoAt + bytes, std::uint8_t{0});
  store_le(&request_[0], static_cast<std::uint16_t>(kCoeHeader + bytes));
  request_[5] = static_cast<std::uint8_t>(kTypeCoe | counter_ << 4);
  store_le(&request_[kMailboxHeader], static_cast<std::uint16_t>(kSdoRequest << 12));
  request_size_ = kSdoAt + bytes;
  status_ = Status::kSend;
  return &request_[kSdoAt];
}

void SdoTransfer::request_initiate(std::uint8_t command, std::size_t bytes) noexcept {
  std::uint8_t* const sdo = start_request(8 + bytes);
  sdo[0] = static_cast<std::uint8_t>(command | (object_.complete ? kCompleteAccess : 0));
  store_le(&sdo[1], object_.index);
  sdo[3] = object_.subindex;
}

void SdoTransfer::request_upload_segment() noexcept {
  std::uint8_t* const sdo = start_request(8);
  sdo[0] = static_cast<std::uint8_t>(kUploadSegmentRequest | (toggle_ ? kToggle : 0));
  expect_ = Expect::kUploadSegment;
}

void SdoTransfer::request_download_segment() noexcept {
  const std::size_t left = size_ - transferred_;
  const std::size_t now = std::min(left, mailbox_bytes_ - kSdoAt - 1);
  std::uint8_t* const sdo = start_request(1 + std::max(now, kSmallestSegment));
  const std::size_t unused = now < kSmallestSegment ? kSmallestSegment - now : 0;
  sdo[0] = static_cast<std::uint8_t>(kDownloadSegmentRequest | (toggle_ ? kToggle : 0) | unused << 1 |
                                     (now == left ? kLastSegment : 0));
  std::copy_n(&source_[transferred_], now, sdo + 1);
  transferred_ += now;
  expect_ = Expect::kDownloadedSegment;
}

void SdoTransfer::fail(const char* problem) noexcept {
  problem_ = problem;
  status_ = Status::kFailed;
}

bool SdoTransfer::is_repetition(const CoeMail& mail) noexcept {
  if (mail.counter == 0) return false;
  const bool same = mail.counter == slave_counter_;
  slave_counts_ = slave_counts_ || (!same && slave_counter_ != 0);
  slave_counter_ = mail.counter;
  return same && slave_counts_;
}

void SdoTransfer::take(std::span<const std::uint8_t> mailbox) noexcept {
  if (!under_way()) return;
  const CoeMail mail = decode_coe(mailbox);
  if (mail.kind == CoeMail::Kind::kMalformed) return fail(mail.problem);
  if (is_repetition(mail)) return skip();
  const bool named = mail.object.index == object_.index && mail.object.subindex == object_.subindex;
  const bool in_segments = expect_ == Expect::kUploadSegment || expect_ == Expect::kDownloadedSegment;
  switch (mail.kind) {
    case CoeMail::Kind::kUpload:
      if (expect_ == Expect::kUpload && named) return take_upload(mail);
      break;
    case CoeMail::Kind::kUploadSegment:
      if (expect_ == Expect::kUploadSegment) return take_upload_segment(mail);
      break;
    case CoeMail::Kind::kDownloaded:
      if (expect_ == Expect::kDownloaded && named) return take_downloaded();
      break;
    case CoeMail::Kind::kDownloadedSegment:
      if (expect_ == Expect::kDownloadedSegment) return take_downloaded_segment(mail);
      break;
    case CoeMail::Kind::kAbort:
      // Some slaves leave out the object when they refuse a segment.
      if (!named && !(in_segments && mail.object == SdoObject{})) break;
      error_code_ = mail.error_code;
      status_ = Status::kAborted;
      return;
    case CoeMail::Kind::kMailboxError: error_code_ = mail.error_code; return fail(nullptr);
    case CoeMail::Kind::kEmergency:
      ++emergencies_;
      last_emergency_ = mail.emergency;
      break;
    case CoeMail::Kind::kOther:
    case CoeMail::Kind::kMalformed: break;
  }
  skip();
}

void SdoTransfer::skip() noexcept {
  status_ = Status::kListen;
  if (++skipped_ > kMaxSkipped) fail("it sends mail after mail, but no reply");
}

void SdoTransfer::take_upload(const CoeMail& mail) noexcept {
  size_ = mail.size;
  if (size_ > destination_.size()) return fail("the object is longer than expected");
  take_upload_data(mail.data);
  if (transferred_ == size_) {
    status_ = Status::kDone;
    return;
  }
  request_upload_segment();
}

void SdoTransfer::take_upload_data(std::span<const std::uint8_t> data) noexcept {
  std::copy(data.begin(), data.end(), destination_.begin() + static_cast<std::ptrdiff_t>(transferred_));
  transferred_ += data.size();
}

void SdoTransfer::take_upload_segment(const CoeMail& mail) noexcept {
  if (mail.toggle != toggle_) return fail("a segment came with the wrong toggle bit");
  if (mail.data.size() > size_ - transferred_) return fail("the segments are longer than the object");
  take_upload_data(mail.data);
  if (mail.last) {
    if (transferred_ != size_) return fail("the segments end before the object does");
    status_ = Status::kDone;
    return;
  }
  if (transferred_ == size_) return fail("more segments are announced than the object needs");
  if (mail.data.empty()) return fail("an empty segment");
  toggle_ = !toggle_;
  request_upload_segment();
}

void SdoTransfer::take_downloaded() noexcept {
  if (transferred_ == size_) {
    status_ = Status::kDone;
    return;
  }
  request_download_segment();
}

void SdoTransfer::take_downloaded_segment(const CoeMail& mail) noexcept {
  if (mail.toggle != toggle_) return fail("a segment was acknowledged with the wrong toggle bit");
  toggle_ = !toggle_;
  take_downloaded();
}

std::string SdoTransfer::failure() const {
  std::string text;
  std::array<char, 64> number{};
  if (status_ == Status::kAborted) {
    std::snprintf(number.data(), number.size(), "0x%08X", static_cast<unsigned>(error_code_));
    text = "refused with abort code " + std::string(number.data()) + ", " + describe_sdo_abort(error_code_);
  } else if (status_ == Status::kFailed && problem_ == nullptr) {
    std::snprintf(number.data(), number.size(), "0x%04X", static_cast<unsigned>(error_code_));
    text = "mailbox error " + std::string(number.data()) + ", " +
           describe_mailbox_error(static_cast<std::uint16_t>(error_code_));
  } else if (status_ == Status::kFailed) {
    text = problem_;
  }
  if (!text.empty() && emergencies_ > 0) {
    std::snprintf(number.data(), number.size(), "; it also reported emergency 0x%04X (",
                  static_cast<unsigned>(last_emergency_.error_code));
    text += std::string(number.data()) + describe_emergency(last_emergency_.error_code) + ")";
  }
  return text;
}

}  // namespace drivers::ethercat
