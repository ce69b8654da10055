#include "apps/youbotd/page_requests.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include "apps/youbotd/request.h"
#include "hal/setup_error.h"

namespace youbotd {

namespace {

bool can_move(std::string_view request) {
  const std::string_view command = command_of(request);
  return command == "enable" || command == "acknowledge" || command == "set" || command == "steer";
}

}  // namespace

PageRequests::PageRequests() : wake_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (wake_ < 0)
    throw hal::SetupError("page", std::string("event descriptor: ") + std::strerror(errno),
                          "allow more open files (ulimit -n)");
}

PageRequests::~PageRequests() { close(wake_); }

void PageRequests::wake() const noexcept {
  const std::uint64_t one = 1;
  // Fails only when it is about to wake anyway.
  [[maybe_unused]] const ssize_t written = write(wake_, &one, sizeof one);
}

void PageRequests::ask(const Peer& peer, const std::string& request, Page::Reply reply) {
  if (command_of(request) == "stop") {
    stop(peer.name);
    return reply(R"({"ok": true})");
  }
  {
    const std::lock_guard lock(mutex_);
    const auto of_this_peer = std::ranges::count(entries_, peer.connection,
                                                 [](const Entry& entry) { return entry.peer.connection; });
    if (entries_.size() < kMaxPageRequests && of_this_peer < kMaxRequestsOfAPage) {
      entries_.push_back({peer, request, std::move(reply)});
      reply = nullptr;
    }
  }
  if (reply) return reply(R"({"ok": false, "error": "too many requests of pages wait: try again"})");
  wake();
}

void PageRequests::stop(const std::string& who) {
  {
    const std::lock_guard lock(mutex_);
    stopped_by_ = who;
    before_the_stop_ = entries_.size();
  }
  wake();
}

/// Only a peer that may command matters. Not bounded: one for each of their connections.
void PageRequests::gone(const Peer& peer) {
  if (!peer.may_command) return;
  {
    const std::lock_guard lock(mutex_);
    entries_.push_back({peer, "", nullptr});
  }
  wake();
}

void PageRequests::deliver(ControlServer::Listener& listener) {
  std::uint64_t wakes = 0;
  [[maybe_unused]] const ssize_t size = read(wake_, &wakes, sizeof wakes);
  std::deque<Entry> entries;
  std::string stopped_by;
  std::size_t outdated = 0;
  {
    const std::lock_guard lock(mutex_);
    entries.swap(entries_);
    stopped_by.swap(stopped_by_);
    std::swap(outdated, before_the_stop_);
  }
  if (!stopped_by.empty()) (void)listener.answer({.name = stopped_by}, "stop");
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Entry& entry = entries[i];
    if (entry.request.empty())
      listener.gone(entry.peer);
    else if (i < outdated && can_move(entry.request))  // asked for before the stop
      entry.reply(R"({"ok": false, "error": "a stop came after this request"})");
    else
      entry.reply(listener.answer(entry.peer, entry.request));
  }
}

}  // namespace youbotd
