// Mails byte by byte according to ETG.1000.6, section 5.6.2; then whole transfers against a small SDO server
// written for this test, and over the wire with an emulated slave.
#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/coe_sdo.h"
#include "drivers/ethercat/sdo_client.h"
#include "sim/bus/bus_link.h"
#include "tests/drivers/coe_board.h"
#include "tests/support/no_alloc_guard.h"

namespace drivers::ethercat {
namespace ethercat_coe_sdo_test {

using Kind = CoeMail::Kind;
using Status = SdoTransfer::Status;
using namespace std::chrono_literals;

using namespace test;

// ---- known bytes ----

TEST(CoeRequest, ReadingTheVendorIdIsTheStandardsUploadRequest) {
  SdoTransfer transfer;
  Bytes buffer(4);
  transfer.begin_upload({0x1018, 1}, buffer, kMailbox);
  ASSERT_EQ(transfer.status(), Status::kSend);
  EXPECT_EQ(bytes_of(transfer.request()),
            (Bytes{0x0A, 0, 0, 0, 0, 0x13, 0, 0x20, 0x40, 0x18, 0x10, 1, 0, 0, 0, 0}));
}

TEST(CoeRequest, SmallObjectsAreWrittenExpedited) {
  const std::vector<std::pair<Bytes, Bytes>> cases{
      {{0xAA}, {0x2F, 0x60, 0x60, 0, 0xAA, 0, 0, 0}},
      {{0xAA, 0xBB}, {0x2B, 0x60, 0x60, 0, 0xAA, 0xBB, 0, 0}},
      {{0xAA, 0xBB, 0xCC}, {0x27, 0x60, 0x60, 0, 0xAA, 0xBB, 0xCC, 0}},
      {{0xAA, 0xBB, 0xCC, 0xDD}, {0x23, 0x60, 0x60, 0, 0xAA, 0xBB, 0xCC, 0xDD}},
  };
  for (const auto& [data, sdo] : cases) {
    SdoTransfer transfer;
    transfer.begin_download({0x6060, 0}, data, kMailbox);
    Bytes expected{0x0A, 0, 0, 0, 0, 0x13, 0, 0x20};
    expected.insert(expected.end(), sdo.begin(), sdo.end());
    EXPECT_EQ(bytes_of(transfer.request()), expected);
    transfer.take(response({0x60, 0x60, 0x60, 0, 0, 0, 0, 0}));
    EXPECT_EQ(transfer.status(), Status::kDone);
  }
}

TEST(CoeRequest, CompleteAccessSetsItsBit) {
  SdoTransfer transfer;
  Bytes buffer(4);
  transfer.begin_upload({0x1C12, 0, true}, buffer, kMailbox);
  EXPECT_EQ(transfer.request()[8], 0x50);
  transfer.begin_download({0x1C12, 0, true}, Bytes{1, 0}, kMailbox);
  EXPECT_EQ(transfer.request()[8], 0x3B);
}

TEST(CoeRequest, AnObjectThatFitsIsWrittenInOneMail) {
  SdoTransfer transfer;
  const Bytes data{1, 2, 3, 4, 5};
  transfer.begin_download({0x2000, 3}, data, kMailbox);
  EXPECT_EQ(bytes_of(transfer.request()), (Bytes{0x0F, 0,    0,    0, 0, 0x13, 0, 0x20,  //
                                                 0x21, 0x00, 0x20, 3, 5, 0,    0, 0,     //
                                                 1,    2,    3,    4, 5}));
  transfer.take(response({0x60, 0x00, 0x20, 3, 0, 0, 0, 0}));
  EXPECT_EQ(transfer.status(), Status::kDone);
}

TEST(CoeRequest, AnEmptyObjectIsWrittenWithSizeZero) {
  SdoTransfer transfer;
  transfer.begin_download({0x2000, 3}, {}, kMailbox);
  EXPECT_EQ(bytes_of(transfer.request()),
            (Bytes{0x0A, 0, 0, 0, 0, 0x13, 0, 0x20, 0x21, 0x00, 0x20, 3, 0, 0, 0, 0}));
}

TEST(CoeRequest, ALongObjectIsWrittenInSegments) {
  SdoTransfer transfer;
  Bytes data(18 - 16 + 9 + 5);  // 2 bytes fit into the first mail of 18, 9 into each segment
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i);
  transfer.begin_download({0x2000, 3}, data, 18);
  EXPECT_EQ(bytes_of(transfer.request()), (Bytes{0x0C, 0, 0, 0, 0, 0x13, 0, 0x20,  //
                                                 0x21, 0x00, 0x20, 3, 16, 0, 0, 0, 0, 1}));
  transfer.take(response({0x60, 0x00, 0x20, 3, 0, 0, 0, 0}, 1));
  EXPECT_EQ(bytes_of(transfer.request()),
            (Bytes{0x0C, 0, 0, 0, 0, 0x23, 0, 0x20, 0x00, 2, 3, 4, 5, 6, 7, 8, 9, 10}));
  transfer.take(response({0x20, 0, 0, 0, 0, 0, 0, 0}, 2));
  // The last one: toggled, 7 - 5 bytes unused, at least 7 bytes long.
  EXPECT_EQ(bytes_of(transfer.request()),
            (Bytes{0x0A, 0, 0, 0, 0, 0x33, 0, 0x20, 0x10 | 2 << 1 | 1, 11, 12, 13, 14, 15, 0, 0}));
  transfer.take(response({0x30, 0, 0, 0, 0, 0, 0, 0}, 3));
  EXPECT_EQ(transfer.status(), Status::kDone);
}

TEST(CoeRequest, CountersRunFromOneToSevenAcrossTransfers) {
  SdoTransfer transfer;
  Bytes buffer(4);
  Bytes counters;
  for (int i = 0; i < 9; ++i) {
    transfer.begin_upload({0x1000, 0}, buffer, kMailbox);
    counters.push_back(transfer.request()[5] >> 4);
  }
  EXPECT_EQ(counters, (Bytes{1, 2, 3, 4, 5, 6, 7, 1, 2}));
}

TEST(CoeReply, AnExpeditedUploadCarriesOneToFourBytes) {
  for (const auto& [command, size] : std::vector<std::pair<std::uint8_t, std::size_t>>{
           {0x4F, 1}, {0x4B, 2}, {0x47, 3}, {0x43, 4}, {0x42, 4}}) {
    const Bytes bytes = response({command, 0x18, 0x10, 1, 0x86, 0x02, 0x03, 0x04});
    const CoeMail mail = decode_coe(bytes);
    EXPECT_EQ(mail.kind, Kind::kUpload);
    EXPECT_EQ(mail.object, (SdoObject{0x1018, 1}));
    EXPECT_EQ(mail.counter, 1);
    EXPECT_EQ(bytes_of(mail.data), bytes_of(std::span(bytes).subspan(12, size)));
  }
}

TEST(CoeReply, ADeviceNameComesAsANormalUpload) {
  Bytes sdo{0x41, 0x08, 0x10, 0, 6, 0, 0, 0};
  const Bytes name = bytes_of(std::string("EK1100"));
  sdo.insert(sdo.end(), name.begin(), name.end());
  SdoTransfer transfer;
  Bytes buffer(64);
  transfer.begin_upload({0x1008, 0}, buffer, kMailbox);
  transfer.take(response(sdo));
  EXPECT_EQ(transfer.status(), Status::kDone);
  EXPECT_EQ(transfer.transferred(), 6U);
  EXPECT_EQ(Bytes(buffer.begin(), buffer.begin() + 6), name);
}

TEST(CoeReply, SegmentsOfAnUploadAreAskedForAndJoined) {
  SdoTransfer transfer;
  Bytes buffer(64);
  transfer.begin_upload({0x1008, 0}, buffer, kMailbox);
  transfer.take(response({0x41, 0x08, 0x10, 0, 20, 0, 0, 0, 'a', 'b', 'c'}, 1));
  EXPECT_EQ(bytes_of(transfer.request()),
            (Bytes{0x0A, 0, 0, 0, 0, 0x23, 0, 0x20, 0x60, 0, 0, 0, 0, 0, 0, 0}));
  // Longer than 7 bytes: its length says how much there is, whatever the size bits say.
  transfer.take(response({0x00 | 3 << 1, 'd', 'e', 'f', 'g', 'h', 'i', 'j', 'k', 'l', 'm', 'n', 'o'}, 2));
  EXPECT_EQ(transfer.request()[8], 0x70);
  transfer.take(response({0x10 | 2 << 1 | 1, 'p', 'q', 'r', 's', 't', 0, 0}, 3));
  EXPECT_EQ(transfer.status(), Status::kDone);
  EXPECT_EQ(transfer.transferred(), 20U);
  EXPECT_EQ(Bytes(buffer.begin(), buffer.begin() + 20), bytes_of(std::string("abcdefghijklmnopqrst")));
}

TEST(CoeReply, AnAbortIsTakenInBothServices) {
  for (const std::uint8_t service : {std::uint8_t{2}, std::uint8_t{3}}) {
    SdoTransfer transfer;
    Bytes buffer(4);
    transfer.begin_upload({0x1018, 9}, buffer, kMailbox);
    transfer.take(response({0x80, 0x18, 0x10, 9, 0x11, 0x00, 0x09, 0x06}, 1, service));
    EXPECT_EQ(transfer.status(), Status::kAborted);
    EXPECT_EQ(transfer.abort_code(), 0x06090011U);
    EXPECT_EQ(transfer.failure(), "refused with abort code 0x06090011, subindex does not exist");
  }
}

TEST(CoeReply, EveryAbortCodeOfTheStandardHasItsOwnWords) {
  const std::vector<std::uint32_t> codes{
      0x05030000, 0x05040000, 0x05040001, 0x05040005, 0x06010000, 0x06010001, 0x06010002, 0x06010003,
      0x06010004, 0x06010005, 0x06010006, 0x06020000, 0x06040041, 0x06040042, 0x06040043, 0x06040047,
      0x06060000, 0x06070010, 0x06070012, 0x06070013, 0x06090011, 0x06090030, 0x06090031, 0x06090032,
      0x06090033, 0x06090036, 0x08000000, 0x08000020, 0x08000021, 0x08000022, 0x08000023};
  std::map<std::string, int> words;
  for (const std::uint32_t code : codes) ++words[describe_sdo_abort(code)];
  EXPECT_EQ(words.size(), codes.size());
  EXPECT_EQ(words.count("unknown abort code"), 0U);
  EXPECT_STREQ(describe_sdo_abort(0x12345678), "unknown abort code");
}

TEST(CoeReply, AMailboxErrorEndsTheTransferInWords) {
  SdoTransfer transfer;
  Bytes buffer(4);
  transfer.begin_upload({0x1018, 1}, buffer, kMailbox);
  transfer.take(padded({4, 0, 0, 0, 0, 0x10, 1, 0, 2, 0}));
  EXPECT_EQ(transfer.status(), Status::kFailed);
  EXPECT_EQ(transfer.failure(), "mailbox error 0x0002, mailbox protocol not supported");
}

// ---- what answers something else ----

TEST(SdoTransfer, AnEmergencyInBetweenIsKeptAndSkipped) {
  SdoTransfer transfer;
  Bytes buffer(4);
  transfer.begin_upload({0x1018, 1}, buffer, kMailbox);
  transfer.take(emergency(0x2310, 1));
  EXPECT_EQ(transfer.status(), Status::kListen);
  EXPECT_FALSE(transfer.must_send());
  EXPECT_EQ(transfer.emergencies(), 1U);
  EXPECT_EQ(transfer.last_emergency().error_code, 0x2310);
  EXPECT_EQ(transfer.last_emergency().error_register, 0x21);
  EXPECT_EQ(transfer.last_emergency().data, (std::array<std::uint8_t, 5>{1, 2, 3, 4, 5}));
  transfer.take(response({0x80, 0x18, 0x10, 1, 0, 0, 0, 0x08}, 2));
  EXPECT_EQ(transfer.failure(),
            "refused with abort code 0x08000000, general error; it also reported emergency 0x2310 (current)");
}

TEST(SdoTransfer, OtherProtocolsServicesAndObjectsAreSkipped) {
  SdoTransfer transfer;
  Bytes buffer(4);
  transfer.begin_upload({0x1018, 1}, buffer, kMailbox);
  Bytes eoe = response({0, 0, 0, 0, 0, 0, 0, 0}, 1);
  eoe[5] = 0x12;
  const std::vector<Bytes> others{
      eoe,
      response({0, 0, 0, 0, 0, 0, 0, 0}, 2, 8),        // SDO information
      response({0x4F, 0x18, 0x10, 2, 7, 0, 0, 0}, 3),  // another subindex
      response({0x4F, 0x19, 0x10, 1, 7, 0, 0, 0}, 4),  // another object
      response({0x80, 0x18, 0x10, 2, 0, 0, 0, 8}, 5),  // abort of another object
      response({0x60, 0x18, 0x10, 1, 0, 0, 0, 0}, 6),  // a download is done
      response({0x01, 0, 0, 0, 0, 0, 0, 0}, 7),        // a segment
  };
  for (const Bytes& other : others) {
    transfer.take(other);
    EXPECT_EQ(transfer.status(), Status::kListen);
  }
  transfer.take(response({0x4F, 0x18, 0x10, 1, 7, 0, 0, 0}, 1));
  EXPECT_EQ(transfer.status(), Status::kDone);
  EXPECT_EQ(buffer[0], 7);
}

TEST(SdoTransfer, ASlaveThatNeverAnswersEndsIt) {
  SdoTransfer transfer;
  Bytes buffer(4);
  transfer.begin_upload({0x1018, 1}, buffer, kMailbox);
  int mails = 0;
  while (transfer.under_way() && mails < 1000) {
    transfer.take(emergency(0x5000, static_cast<std::uint8_t>(mails % 7 + 1)));
    ++mails;
  }
  EXPECT_EQ(transfer.status(), Status::kFailed);
  EXPECT_EQ(mails, 33) << "32 are skipped, and not one more";
}

TEST(SdoTransfer, ARepeatedMailIsNotTakenForTheNextReply) {
  SdoTransfer transfer;
  Bytes buffer(4);
  for (std::uint8_t counter = 1; counter <= 2; ++counter) {
    transfer.begin_upload({0x2000, 0}, buffer, kMailbox);
    transfer.take(response({0x4F, 0x00, 0x20, 0, counter, 0, 0, 0}, counter));
  }
  transfer.begin_upload({0x2000, 0}, buffer, kMailbox);
  transfer.take(response({0x4F, 0x00, 0x20, 0, 2, 0, 0, 0}, 2));  // once more
  EXPECT_EQ(transfer.status(), Status::kListen);
  transfer.take(response({0x4F, 0x00, 0x20, 0, 3, 0, 0, 0}, 3));
  EXPECT_EQ(transfer.status(), Status::kDone);
  EXPECT_EQ(buffer[0], 3);
}

TEST(SdoTransfer, ASlaveThatDoesNotCountIsUnderstood) {
  for (const std::uint8_t counter : {std::uint8_t{0}, std::uint8_t{1}}) {
    SdoTransfer transfer;
    Bytes buffer(4);
    for (int i = 0; i < 3; ++i) {
      transfer.begin_upload({0x2000, 0}, buffer, kMailbox);
      transfer.take(response({0x4F, 0x00, 0x20, 0, 9, 0, 0, 0}, counter));
      EXPECT_EQ(transfer.status(), Status::kDone);
    }
  }
}

TEST(SdoTransfer, MailsAfterTheEndChangeNothing) {
  SdoTransfer transfer;
  transfer.take(response({0x4F, 0x00, 0x20, 0, 9, 0, 0, 0}));
  EXPECT_EQ(transfer.status(), Status::kIdle);
  Bytes buffer(4);
  transfer.begin_upload({0x2000, 0}, buffer, kMailbox);
  transfer.take(response({0x4F, 0x00, 0x20, 0, 9, 0, 0, 0}, 1));
  transfer.take(response({0x80, 0x00, 0x20, 0, 9, 0, 0, 0}, 2));
  EXPECT_EQ(transfer.status(), Status::kDone);
}

// ---- faults ----

std::vector<Bytes> valid_mails() {
  return {
      response({0x43, 0x18, 0x10, 1, 2, 0, 0, 0}),
      response({0x41, 0x08, 0x10, 0, 6, 0, 0, 0, 'E', 'K', '1', '1', '0', '0'}),
      response({0x01, 1, 2, 3, 4, 5, 6, 7}),
      response({0x60, 0x60, 0x60, 0, 0, 0, 0, 0}),
      response({0x20, 0, 0, 0, 0, 0, 0, 0}),
      response({0x80, 0x18, 0x10, 1, 0, 0, 2, 6}, 1, 2),
      emergency(0x8130),
      padded({4, 0, 0, 0, 0, 0x10, 1, 0, 2, 0}),
  };
}

TEST(CoeMalformed, EveryPrefixOfAValidMailIsRefused) {
  for (const Bytes& mail : valid_mails()) {
    const std::size_t whole = 6U + mail[0];
    EXPECT_NE(decode_coe(std::span(mail).first(whole)).kind, Kind::kMalformed);
    for (std::size_t size = 0; size < whole; ++size) {
      const Bytes prefix(mail.begin(),
                         mail.begin() + static_cast<std::ptrdiff_t>(size));  // for the sanitizer
      const CoeMail decoded = decode_coe(prefix);
      EXPECT_EQ(decoded.kind, Kind::kMalformed) << size;
      EXPECT_STRNE(decoded.problem, "");
    }
  }
}

TEST(CoeMalformed, EveryShorterLengthIsRefusedOrCarriesNoMoreThanItSays) {
  for (const Bytes& mail : valid_mails()) {
    for (std::uint8_t length = 0; length < mail[0]; ++length) {
      Bytes shorter(mail.begin(), mail.begin() + 6 + length);
      shorter[0] = length;
      const CoeMail decoded = decode_coe(shorter);
      if (decoded.kind == Kind::kUpload || decoded.kind == Kind::kUploadSegment) {
        EXPECT_LE(decoded.data.size(), length);
      }
      if (length < 2) {
        EXPECT_EQ(decoded.kind, Kind::kMalformed);
      }
    }
  }
}

TEST(CoeMalformed, ContradictionsAreRefused) {
  const std::vector<Bytes> mails{
      Bytes(kMailbox),                                             // nothing at all
      Bytes(kMailbox, 0xFF),                                       // longer than itself
      response({0x41, 0x08, 0x10, 0, 2, 0, 0, 0, 'a', 'b', 'c'}),  // more data than size
      response({0x40, 0x08, 0x10, 0, 2, 0, 0, 0, 'a', 'b'}),       // no size
      response({0xA0, 0x08, 0x10, 0, 0, 0, 0, 0}),                 // block transfer
      response({}),                                                // no command
  };
  for (const Bytes& mail : mails) {
    EXPECT_EQ(decode_coe(mail).kind, Kind::kMalformed);
    SdoTransfer transfer;
    Bytes buffer(64);
    transfer.begin_upload({0x1008, 0}, buffer, kMailbox);
    transfer.take(mail);
    EXPECT_EQ(transfer.status(), Status::kFailed);
    EXPECT_NE(transfer.failure(), "");
  }
}

TEST(SdoTransfer, ASegmentedUploadThatGoesWrongFails) {
  const std::vector<std::pair<Bytes, std::string>> cases{
      {{0x10, 1, 2, 3, 4, 5, 6, 7}, "a segment came with the wrong toggle bit"},
      {{0x00, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, "the segments are longer than the object"},
      {{0x01, 1, 2, 3, 4, 5, 6, 7}, "the segments end before the object does"},
      {{0x00, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, "more segments are announced than the object needs"},
      {{0x0E, 0, 0, 0, 0, 0, 0, 0}, "an empty segment"},
  };
  for (const auto& [segment, problem] : cases) {
    SdoTransfer transfer;
    Bytes buffer(64);
    transfer.begin_upload({0x1008, 0}, buffer, kMailbox);
    transfer.take(response({0x41, 0x08, 0x10, 0, 12, 0, 0, 0, 'a', 'b'}, 1));
    transfer.take(response(segment, 2));
    EXPECT_EQ(transfer.status(), Status::kFailed);
    EXPECT_EQ(transfer.failure(), problem);
  }
}

TEST(SdoTransfer, AnObjectLongerThanTheBufferFails) {
  SdoTransfer transfer;
  Bytes buffer(5);
  transfer.begin_upload({0x1008, 0}, buffer, kMailbox);
  transfer.take(response({0x41, 0x08, 0x10, 0, 6, 0, 0, 0, 'E', 'K', '1', '1', '0', '0'}));
  EXPECT_EQ(transfer.failure(), "the object is longer than expected");
  Bytes small(2);
  transfer.begin_upload({0x1018, 1}, small, kMailbox);
  transfer.take(response({0x43, 0x18, 0x10, 1, 2, 0, 0, 0}));
  EXPECT_EQ(transfer.status(), Status::kFailed);
}

TEST(SdoTransfer, AWrongToggleOfADownloadFails) {
  SdoTransfer transfer;
  const Bytes data(100);
  transfer.begin_download({0x2000, 0}, data, kMailbox);
  transfer.take(response({0x60, 0x00, 0x20, 0, 0, 0, 0, 0}, 1));
  transfer.take(response({0x30, 0, 0, 0, 0, 0, 0, 0}, 2));
  EXPECT_EQ(transfer.failure(), "a segment was acknowledged with the wrong toggle bit");
}

TEST(SdoTransfer, AMailboxTooShortForCoeFailsBeforeAnythingIsSent) {
  SdoTransfer transfer;
  Bytes buffer(4);
  for (std::size_t bytes = 0; bytes < kMinCoeMailboxBytes; ++bytes) {
    transfer.begin_upload({0x1000, 0}, buffer, bytes);
    EXPECT_EQ(transfer.status(), Status::kFailed);
    transfer.begin_download({0x1000, 0}, buffer, bytes);
    EXPECT_EQ(transfer.status(), Status::kFailed);
    EXPECT_TRUE(transfer.request().empty());
  }
}

// ---- whole transfers ----

void run(SdoTransfer& transfer, SdoServer& server, std::size_t mailbox) {
  std::deque<Bytes> mails;
  while (transfer.under_way()) {
    if (transfer.must_send()) {
      ASSERT_LE(transfer.request().size(), mailbox);
      for (Bytes& mail : server.answer(transfer.request())) mails.push_back(padded(std::move(mail), mailbox));
    }
    ASSERT_FALSE(mails.empty());
    transfer.take(mails.front());
    mails.pop_front();
  }
  EXPECT_TRUE(mails.empty());
}

TEST(SdoTransfer, AnySizeThroughAnyMailboxArrivesUnchanged) {
  for (const std::size_t mailbox : {16U, 17U, 18U, 24U, 32U, 48U, 128U, 1024U, 1486U}) {
    SdoServer server(mailbox);
    server.emergency_before_every = 5;
    SdoTransfer transfer;
    for (std::size_t size = 0; size < 3 * mailbox; size += 1 + size / 64) {
      Bytes data(size);
      for (std::size_t i = 0; i < size; ++i) data[i] = static_cast<std::uint8_t>(i * 7 + size);
      transfer.begin_download({0x2000, 1}, data, mailbox);
      run(transfer, server, mailbox);
      ASSERT_EQ(transfer.status(), Status::kDone) << transfer.failure() << size;
      EXPECT_EQ(server.objects.at({0x2000, 1}), data);

      Bytes back(size);
      transfer.begin_upload({0x2000, 1}, back, mailbox);
      run(transfer, server, mailbox);
      ASSERT_EQ(transfer.status(), Status::kDone) << transfer.failure() << size;
      EXPECT_EQ(transfer.transferred(), size);
      EXPECT_EQ(back, data);
    }
    EXPECT_EQ(server.repetitions, 0U);
  }
}

TEST(SdoTransfer, DoesNotAllocateOrLock) {
  SdoTransfer transfer;
  Bytes buffer(64);
  const Bytes data(20);
  const Bytes first = response({0x41, 0x08, 0x10, 0, 12, 0, 0, 0, 'a', 'b'}, 1);
  const Bytes segment = response({0x01, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, 2);
  const Bytes refused = response({0x80, 0x00, 0x20, 0, 0, 0, 2, 6}, 3);
  const support::NoAllocGuard guard;
  transfer.begin_upload({0x1008, 0}, buffer, kMailbox);
  transfer.take(first);
  transfer.take(segment);
  const bool done = transfer.status() == Status::kDone;
  transfer.begin_download({0x2000, 0}, data, kMailbox);
  transfer.take(refused);
  const long violations = guard.violations();
  EXPECT_TRUE(done);
  EXPECT_EQ(transfer.status(), Status::kAborted);
  EXPECT_EQ(violations, 0);
}

// ---- over the wire ----

class SdoClientOverTheWire : public ::testing::Test {
 protected:
  static sim::bus::SlaveDescription description(std::uint16_t protocols) {
    sim::bus::SlaveDescription slave;
    slave.name = "EL7211";
    slave.mailbox_out = {.start = 0x1000, .length = kMailbox};
    slave.mailbox_in = {.start = 0x1080, .length = kMailbox};
    slave.mailbox_protocols = protocols;
    return slave;
  }
  SdoClientOverTheWire()
      : board(bus.add(description(sim::bus::mailbox_protocol::kCoE)), kMailbox),
        silent(bus.add(description(0))),
        wire(bus, {.timed = true}),
        link(wire) {
    PreOpBus::Options options;
    options.mailbox_timeout = 20ms;
    options.access.frame_timeout = 1ms;
    setup = std::make_unique<PreOpBus>(link, nullptr, options);
    setup->enter_pre_op();
  }

  sim::bus::EmulatedBus bus;
  CoeBoard board;
  sim::bus::EmulatedSlave& silent;
  sim::bus::EmulatedWire wire;
  sim::bus::BusLink link;
  std::unique_ptr<PreOpBus> setup;
};

TEST_F(SdoClientOverTheWire, ReadsAndWritesObjectsOfEverySize) {
  SdoClient client(*setup, 0);
  for (const std::size_t size : {1U, 2U, 4U, 5U, 32U, 33U, 500U}) {
    Bytes data(size);
    for (std::size_t i = 0; i < size; ++i) data[i] = static_cast<std::uint8_t>(i + size);
    client.write(0x2000, 1, data);
    EXPECT_EQ(board.server.objects.at({0x2000, 1}), data);
    EXPECT_EQ(client.read(0x2000, 1), data);
  }
  EXPECT_EQ(board.server.repetitions, 0U);
}

TEST_F(SdoClientOverTheWire, AnEmergencyBeforeTheReplyDisturbsNothing) {
  board.server.objects[{0x1008, 0}] = Bytes(100, 'x');
  board.server.emergency_before_every = 2;
  SdoClient client(*setup, 0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(client.read(0x1008, 0), Bytes(100, 'x'));
  ASSERT_FALSE(client.emergencies().empty());
  EXPECT_EQ(client.emergencies().front().error_code, 0x2310);
}

TEST_F(SdoClientOverTheWire, TheFirst64EmergenciesAreKept) {
  board.server.objects[{0x1008, 0}] = Bytes(4, 'x');
  board.server.emergency_before_every = 1;
  SdoClient client(*setup, 0);
  for (int i = 0; i < 64; ++i) (void)client.read(0x1008, 0);
  EXPECT_EQ(client.emergencies().size(), 64U);
  EXPECT_EQ(client.read(0x1008, 0), Bytes(4, 'x'));
  EXPECT_EQ(client.emergencies().size(), 64U);
}

TEST_F(SdoClientOverTheWire, ARefusalNamesSlaveObjectAndReason) {
  SdoClient client(*setup, 0);
  try {
    (void)client.read(0x6041, 0);
    FAIL();
  } catch (const BusError& error) {
    EXPECT_STREQ(
        error.what(),
        "slave 1 (EL7211): read object 0x6041:00: refused with abort code 0x06020000, the object does "
        "not exist in the object dictionary");
  }
  try {
    client.write(0x1018, 1, Bytes{1, 2, 3, 4});
    FAIL();
  } catch (const BusError& error) {
    EXPECT_STREQ(error.what(),
                 "slave 1 (EL7211): write object 0x1018:01: refused with abort code 0x06010002, attempt to "
                 "write a read-only object");
  }
}

TEST_F(SdoClientOverTheWire, ASlaveThatHangsIsNamedWithTheObject) {
  SdoClient client(*setup, 0);
  bus.slave(0).hang_mailbox(true);
  try {
    (void)client.read(0x6041, 0);
    FAIL();
  } catch (const BusError& error) {
    EXPECT_STREQ(error.what(),
                 "slave 1 (EL7211): read object 0x6041:00: wait for its mailbox: no reply in time");
  }
}

TEST_F(SdoClientOverTheWire, ASlaveWithoutCoeIsNotAsked) {
  EXPECT_THROW(SdoClient(*setup, 1), BusError);
  EXPECT_THROW(SdoClient(*setup, 2), std::out_of_range);
}

}  // namespace ethercat_coe_sdo_test
}  // namespace drivers::ethercat
