// Mails of a CoE slave. First byte: the master's current operation; then mails, each after a length byte.
#include "drivers/ethercat/coe_sdo.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using drivers::ethercat::CoeMail;
using drivers::ethercat::decode_coe;
using drivers::ethercat::describe_emergency;
using drivers::ethercat::describe_sdo_abort;
using drivers::ethercat::SdoObject;
using drivers::ethercat::SdoTransfer;
using fuzz::require;

constexpr SdoObject kObject{0x1008, 0};

void check(const fuzz::Bytes& mailbox) {
  const CoeMail mail = decode_coe(mailbox);
  require(mail.counter <= 7);
  require((mail.kind == CoeMail::Kind::kMalformed) == (*mail.problem != '\0'));
  require(mail.data.empty() || (mail.data.data() >= mailbox.data() &&
                                mail.data.data() + mail.data.size() <= mailbox.data() + mailbox.size()));
  require(mail.kind != CoeMail::Kind::kUpload || mail.data.size() <= mail.size);
  require(*describe_sdo_abort(mail.error_code) != '\0');
  require(*describe_emergency(mail.emergency.error_code) != '\0');
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  const Bytes expedited{16, 10, 0, 0, 0, 0, 0x13, 0, 0x30, 0x43, 0x08, 0x10, 0, 1, 2, 3, 4};
  const Bytes upload{22, 16, 0, 0, 0, 0,   0x13, 0,   0x30, 0x41, 0x08, 0x10,
                     0,  13, 0, 0, 0, 'E', 'K',  '1', '1',  '0',  '0'};
  const Bytes segment{16, 10, 0, 0, 0, 0, 0x23, 0, 0x30, 0x01, 1, 2, 3, 4, 5, 6, 7};
  const Bytes downloaded{16, 10, 0, 0, 0, 0, 0x13, 0, 0x30, 0x60, 0x08, 0x10, 0, 0, 0, 0, 0};
  const Bytes downloaded_segment{16, 10, 0, 0, 0, 0, 0x23, 0, 0x30, 0x20, 0, 0, 0, 0, 0, 0, 0};
  const Bytes downloaded_next{16, 10, 0, 0, 0, 0, 0x33, 0, 0x30, 0x30, 0, 0, 0, 0, 0, 0, 0};
  const Bytes abort{16, 10, 0, 0, 0, 0, 0x33, 0, 0x20, 0x80, 0x08, 0x10, 0, 0, 0, 2, 6};
  const Bytes emergency{16, 10, 0, 0, 0, 0, 0x43, 0, 0x10, 0x10, 0x23, 1, 0, 0, 0, 0, 0};
  const auto joined = [](std::uint8_t first, const std::vector<Bytes>& mails) {
    Bytes all{first};
    for (const Bytes& mail : mails) all.insert(all.end(), mail.begin(), mail.end());
    return all;
  };
  return {joined(0x00, {expedited}), joined(0x40, {emergency, upload, segment}),
          joined(0x40, {upload, abort}), joined(0x01, {downloaded}),
          joined(0x49, {downloaded, downloaded_segment, emergency, downloaded_next})};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const std::uint8_t scenario = input.byte();
  const std::size_t mailbox = std::size_t{16} + (scenario >> 1 & 0x1FU);
  fuzz::Bytes memory(std::size_t{scenario >> 6U & 3U} * 20 + 4);
  SdoTransfer transfer;
  if ((scenario & 1) != 0)
    transfer.begin_download(kObject, memory, mailbox);
  else
    transfer.begin_upload(kObject, memory, mailbox);
  while (!input.empty()) {
    const std::size_t length = input.byte();
    const fuzz::Bytes mail = input.bytes(length);
    check(mail);
    require(!transfer.must_send() ||
            (transfer.request().size() >= 16 && transfer.request().size() <= mailbox));
    transfer.take(mail);
    require(transfer.transferred() <= memory.size());
    using Status = SdoTransfer::Status;
    require(transfer.failure().empty() ==
            (transfer.status() != Status::kAborted && transfer.status() != Status::kFailed));
    require((scenario & 1) == 0 || transfer.status() != Status::kDone ||
            transfer.transferred() == memory.size());
  }
  return 0;
}
