/// @file
/// Requests of pages and of ROS 2, on their way from their threads to the service's.
#pragma once
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <string>

#include "apps/youbotd/control_server.h"
#include "apps/youbotd/page.h"

namespace youbotd {

inline constexpr std::size_t kMaxPageRequests = 64;       ///< of all pages, which wait
inline constexpr std::ptrdiff_t kMaxRequestsOfAPage = 8;  ///< of one page, or of ROS 2

/// Also a file descriptor that wakes the service's thread, for ControlServer::serve().
class PageRequests final : public Page::Commands {
 public:
  /// @throws hal::SetupError if the system has no descriptor left.
  PageRequests();
  ~PageRequests() override;

  // Any thread.
  void ask(const Peer& peer, const std::string& request, Page::Reply reply) override;
  void stop(const std::string& who) override;
  void gone(const Peer& peer) override;

  // The service's thread.
  int wake_descriptor() const noexcept { return wake_; }
  /// Passes on what has arrived: a stop first, and then no request that came before it.
  void deliver(ControlServer::Listener& listener);

 private:
  struct Entry {
    Peer peer;
    std::string request;  // empty: the peer is gone
    Page::Reply reply;
  };
  void wake() const noexcept;

  int wake_ = -1;
  std::mutex mutex_;
  std::deque<Entry> entries_;
  std::string stopped_by_;           // empty: no stop
  std::size_t before_the_stop_ = 0;  // entries
};

}  // namespace youbotd
