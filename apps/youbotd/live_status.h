/// @file
/// Completes a status for page and topics by what they read of the cycle.
#pragma once
#include <nlohmann/json.hpp>

#include "operation/live_feed.h"

namespace youbotd {

/// One thread, that of the reader.
class LiveStatus {
 public:
  /// `commanded`: there is a service, whose status has phase and devices already. Feed and reader must
  /// outlive it.
  LiveStatus(const operation::LiveFeed& feed, const operation::LiveFeed::Reader& reader, bool commanded)
      : feed_(feed), reader_(reader), commanded_(commanded) {}

  /// Each sample that was read.
  void hear(const operation::LiveSample& sample);
  void complete(nlohmann::json& status) const;

 private:
  const operation::LiveFeed& feed_;
  const operation::LiveFeed::Reader& reader_;
  bool commanded_;
  const char* phase_ = "off";  // of the newest sample
};

}  // namespace youbotd
