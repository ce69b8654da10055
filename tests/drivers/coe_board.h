/// @file
/// A CoE slave for tests: an SDO server according to the standard, on an emulated board.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/ethercat/frame.h"
#include "sim/bus/emulated_bus.h"

namespace drivers::ethercat::test {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::size_t kMailbox = 48;

inline Bytes padded(Bytes bytes, std::size_t size = kMailbox) {
  bytes.resize(std::max(size, bytes.size()));
  return bytes;
}
inline Bytes bytes_of(std::span<const std::uint8_t> span) { return {span.begin(), span.end()}; }
inline Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

/// A CoE mail of service 3 with `sdo` in it.
inline Bytes response(Bytes sdo, std::uint8_t counter = 1, std::uint8_t service = 3) {
  const auto length = static_cast<std::uint8_t>(sdo.size() + 2);
  Bytes mail{length, 0,
             0,      0,
             0,      static_cast<std::uint8_t>(counter << 4 | 3),
             0,      static_cast<std::uint8_t>(service << 4)};
  mail.insert(mail.end(), sdo.begin(), sdo.end());
  return padded(std::move(mail));
}
inline Bytes emergency(std::uint16_t code, std::uint8_t counter = 1) {
  return response(
      {static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(code >> 8), 0x21, 1, 2, 3, 4, 5}, counter,
      1);
}

/// An SDO server according to the standard, with a configurable mailbox size.
class SdoServer {
 public:
  explicit SdoServer(std::size_t mailbox) : mailbox_(mailbox) {}

  std::map<std::pair<int, int>, Bytes> objects;
  unsigned emergency_before_every = 0;  // before every n-th reply; 0: none
  bool count = true;
  std::size_t repetitions = 0;  // requests with an unchanged counter

  std::deque<Bytes> answer(std::span<const std::uint8_t> mail) {
    std::deque<Bytes> replies;
    const std::size_t length = load_le<std::uint16_t>(mail.data());
    if (length < 10 || (mail[5] & 0x0F) != 3) return replies;  // not for us
    if (mail[5] >> 4 == last_counter_ || mail[5] >> 4 == 0) ++repetitions;
    last_counter_ = mail[5] >> 4;
    if (emergency_before_every > 0 && ++requests_ % emergency_before_every == 0)
      replies.push_back(emergency(0x2310, next_counter()));
    replies.push_back(coe_reply(sdo(bytes_of(mail.subspan(8, length - 2)))));
    return replies;
  }

 private:
  std::uint8_t next_counter() {
    counter_ = static_cast<std::uint8_t>(counter_ % 7 + 1);
    return count ? counter_ : 0;
  }
  Bytes coe_reply(Bytes sdo) {
    sdo.resize(std::max<std::size_t>(sdo.size(), 8));
    Bytes mail = response(sdo, next_counter());
    store_le(mail.data(), static_cast<std::uint16_t>(sdo.size() + 2));
    mail.resize(8 + sdo.size());
    EXPECT_LE(mail.size(), mailbox_);
    return mail;
  }
  Bytes abort(std::uint32_t code) {
    Bytes sdo{0x80,
              static_cast<std::uint8_t>(index_),
              static_cast<std::uint8_t>(index_ >> 8),
              static_cast<std::uint8_t>(subindex_),
              0,
              0,
              0,
              0};
    store_le(&sdo[4], code);
    return sdo;
  }
  Bytes head(std::uint8_t command) {
    return {command, static_cast<std::uint8_t>(index_), static_cast<std::uint8_t>(index_ >> 8),
            static_cast<std::uint8_t>(subindex_)};
  }

  Bytes sdo(const Bytes& request) {
    const int command = request[0] >> 5;
    const bool toggle = (request[0] & 0x10) != 0;
    if (command == 1 || command == 2) {
      index_ = request[1] | request[2] << 8;
      subindex_ = request[3];
      toggle_ = false;
    }
    if (command == 2) {  // upload
      const auto found = objects.find({index_, subindex_});
      if (found == objects.end()) return abort(0x06020000);
      data_ = found->second;
      if (data_.size() <= 4 && !data_.empty()) {
        Bytes reply = head(static_cast<std::uint8_t>(0x43 | (4 - data_.size()) << 2));
        reply.insert(reply.end(), data_.begin(), data_.end());
        return reply;
      }
      Bytes reply = head(0x41);
      reply.resize(8);
      store_le(&reply[4], static_cast<std::uint32_t>(data_.size()));
      at_ = std::min(data_.size(), mailbox_ - 16);
      reply.insert(reply.end(), data_.begin(), data_.begin() + static_cast<std::ptrdiff_t>(at_));
      return reply;
    }
    if (command == 3) {  // upload segment
      if (toggle != toggle_) return abort(0x05030000);
      const std::size_t now = std::min(data_.size() - at_, mailbox_ - 9);
      const std::size_t unused = now < 7 ? 7 - now : 0;
      const bool last = at_ + now == data_.size();
      Bytes reply{static_cast<std::uint8_t>((toggle ? 0x10 : 0) | unused << 1 | (last ? 1U : 0U))};
      const auto begin = data_.begin() + static_cast<std::ptrdiff_t>(at_);
      reply.insert(reply.end(), begin, begin + static_cast<std::ptrdiff_t>(now));
      at_ += now;
      toggle_ = !toggle_;
      return reply;
    }
    if (command == 1) {  // download
      if (index_ == 0x1018) return abort(0x06010002);
      if ((request[0] & 2) != 0) {
        objects[{index_, subindex_}] =
            Bytes(request.begin() + 4, request.begin() + 8 - (request[0] >> 2 & 3));
        return head(0x60);
      }
      expected_ = load_le<std::uint32_t>(&request[4]);
      data_.assign(request.begin() + 8, request.end());
      if (data_.size() == expected_) objects[{index_, subindex_}] = data_;
      return head(0x60);
    }
    if (command == 0) {  // download segment
      if (toggle != toggle_) return abort(0x05030000);
      const std::size_t unused = request.size() == 8 ? (request[0] >> 1 & 7U) : 0U;
      data_.insert(data_.end(), request.begin() + 1, request.end() - static_cast<std::ptrdiff_t>(unused));
      const bool last = (request[0] & 1) != 0;
      if (last != (data_.size() == expected_)) return abort(0x06070010);
      if (last) objects[{index_, subindex_}] = data_;
      toggle_ = !toggle_;
      return {static_cast<std::uint8_t>(0x20 | (toggle ? 0x10 : 0))};
    }
    return abort(0x05040001);
  }

  std::size_t mailbox_;
  int index_ = 0;
  int subindex_ = 0;
  bool toggle_ = false;
  Bytes data_;
  std::size_t at_ = 0;
  std::size_t expected_ = 0;
  std::uint8_t counter_ = 0;
  std::uint8_t last_counter_ = 0;
  unsigned requests_ = 0;
};

/// The server as the firmware of an emulated slave: one reply at a time, the next one as soon as there is
/// room.
class CoeBoard final : public sim::bus::Application {
 public:
  CoeBoard(sim::bus::EmulatedSlave& slave, std::size_t mailbox) : server(mailbox), slave_(slave) {
    slave.attach(*this);
  }
  bool mailbox_received(std::span<const std::uint8_t> message) noexcept override {
    for (Bytes& reply : server.answer(message)) replies_.push_back(std::move(reply));
    post();
    return true;
  }
  void advance(std::chrono::nanoseconds /*step*/) noexcept override { post(); }

  SdoServer server;

 private:
  void post() noexcept {
    while (!replies_.empty() && slave_.post_mailbox(replies_.front())) replies_.pop_front();
  }
  sim::bus::EmulatedSlave& slave_;
  std::deque<Bytes> replies_;
};

}  // namespace drivers::ethercat::test
