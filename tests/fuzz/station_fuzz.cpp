// Datagrams of the link between two stations: the plain message, and everything before its authentication.
#include <algorithm>
#include <array>

#include "drivers/station/message.h"
#include "drivers/station/session.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using namespace drivers::station;
using fuzz::Bytes;
using fuzz::require;

const Key kKey({7});
constexpr Challenge kChallenge{1, 2, 3};

template <typename AnyMessage>
Bytes encoded(const AnyMessage& message) {
  Bytes bytes(kMaxMessageBytes);
  bytes.resize(encode(message, bytes));
  return bytes;
}

/// What is accepted is what encode() writes.
template <typename AnyMessage>
void check_message(const Bytes& bytes) {
  AnyMessage message;
  if (!decode(bytes, message)) return;
  require(encoded(message) == bytes);
}

}  // namespace

std::vector<Bytes> fuzz::seeds() {
  HandleMessage handle;
  handle.count = 3;
  ForceMessage force;
  force.count = 1;
  Session session(kKey, kChallenge, kChallenge, Side::kOperator);
  Bytes sealed(kMaxMessageBytes);
  sealed.resize(session.seal(encoded(handle), sealed));
  const GreetingDatagram hello = seal_greeting(kKey, Side::kOperator, {kChallenge, kChallenge});
  return {encoded(handle), encoded(force), sealed, Bytes(hello.begin(), hello.end())};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, data + size);
  check_message<HandleMessage>(bytes);
  check_message<ForceMessage>(bytes);

  Greeting greeting;
  (void)open_greeting(kKey, Side::kOperator, bytes, greeting);
  (void)open_greeting(kKey, Side::kRobot, bytes, greeting);
  Session session(kKey, kChallenge, kChallenge, Side::kRobot);
  Bytes plain(kMaxMessageBytes);
  const Session::Opened opened = session.open(bytes, plain);
  const bool genuine =
      opened.verdict == Session::Verdict::kNewest || opened.verdict == Session::Verdict::kLate;
  // Only the operator's side can make one.
  if (genuine) {
    require(opened.bytes + kDatagramHeaderBytes + kTagBytes == bytes.size());
    require(session.open(bytes, plain).verdict == Session::Verdict::kReplayed);
  }
  return 0;
}
