// Messages on /cmd_vel and /cmd_vel_stamped: from anyone on the network, at any time.
#include "apps/youbotd/cmd_vel.h"

#include <string_view>

#include "runtime/mcap/cdr.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

using fuzz::Bytes;
using fuzz::require;
using youbotd::CmdVel;

/// Publisher and form, pause in units of 4 ms, size, message.
void append(Bytes& bytes, std::uint8_t publisher, std::uint8_t pause, std::string_view payload) {
  bytes.insert(bytes.end(), {publisher, pause, static_cast<std::uint8_t>(payload.size())});
  bytes.insert(bytes.end(), payload.begin(), payload.end());
}

}  // namespace

std::vector<Bytes> fuzz::seeds() {
  runtime::mcap::CdrWriter plain;
  runtime::mcap::CdrWriter stamped;
  stamped.number(std::int32_t{1});
  stamped.number(std::uint32_t{2});
  stamped.string("base_link");
  for (const double number : {0.1, -0.2, 0.0, 0.0, 0.0, 0.3}) {
    plain.number(number);
    stamped.number(number);
  }
  Bytes bytes;
  // Steadily for more than half a second, another publisher in between.
  append(bytes, 0, 120, plain.payload());
  append(bytes, 3, 0, stamped.payload());
  append(bytes, 1, 120, stamped.payload());
  append(bytes, 0, 120, plain.payload());
  return {bytes};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace std::chrono_literals;
  CmdVel cmd_vel(500ms);
  fuzz::Input input(data, size);
  const CmdVel::Time begin{1h};
  CmdVel::Time now = begin;
  while (!input.empty()) {
    const std::uint8_t who = input.byte();
    now += 4ms * input.byte();
    const Bytes message = input.bytes(input.byte());
    cmd_vel.hear(who / 2U, who % 2 == 0 ? CmdVel::Form::kTwist : CmdVel::Form::kTwistStamped,
                 {reinterpret_cast<const char*>(message.data()), message.size()}, now);
    if (const auto command = cmd_vel.take()) {
      require(command->twist_B.allFinite());
      require(command->twist_B.lpNorm<Eigen::Infinity>() <= CmdVel::kLargest);
      require(now - begin >= youbotd::Freshness::kLongSilence);
    }
  }
  return 0;
}
