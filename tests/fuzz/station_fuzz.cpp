// Datagrams of the link between two stations: the plain message, everything before its authentication, and
// what a station with the key can send.
#include <algorithm>
#include <array>
#include <chrono>

#include "drivers/station/message.h"
#include "drivers/station/session.h"
#include "drivers/station/traffic.h"
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

/// Both are sealed in one session: the second one meets the measurements of the first.
void check_traffic(const Bytes& plain) {
  if (plain.size() > kMaxMessageBytes - kDatagramHeaderBytes - kTagBytes) return;
  constexpr std::chrono::seconds kNow{1000};
  Traffic<ForceState, HandleState> robot(kMaxRepeated);
  robot.begin(Session(kKey, kChallenge, kChallenge, Side::kRobot), kNow);
  Session operating(kKey, kChallenge, kChallenge, Side::kOperator);
  for (int i = 0; i < 2; ++i) {
    Bytes sealed(kMaxMessageBytes);
    sealed.resize(operating.seal(plain, sealed));
    const bool counts = robot.take(sealed, kNow);
    require(!counts || kNow - std::chrono::nanoseconds(robot.newest().link.echo_ns) -
                               std::chrono::microseconds(robot.newest().link.echo_held_us) <=
                           kMaxAge);
    (void)robot.report(kNow, kMaxAge);
    require(!robot.make({}, {}, kNow).empty());
  }
}

}  // namespace

std::vector<Bytes> fuzz::seeds() {
  HandleMessage handle;
  handle.count = 3;
  HandleMessage answer = handle;
  answer.link.echo_ns = 999'900'000'000;
  ForceMessage force;
  force.count = 1;
  Session session(kKey, kChallenge, kChallenge, Side::kOperator);
  Bytes sealed(kMaxMessageBytes);
  sealed.resize(session.seal(encoded(handle), sealed));
  const GreetingDatagram hello = seal_greeting(kKey, Side::kOperator, {kChallenge, kChallenge});
  return {encoded(handle), encoded(answer), encoded(force), sealed, Bytes(hello.begin(), hello.end())};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, data + size);
  check_message<HandleMessage>(bytes);
  check_message<ForceMessage>(bytes);
  check_traffic(bytes);

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
