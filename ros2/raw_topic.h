/// @file
/// Topics of DDS whose samples are the serialized bytes themselves.
#pragma once
#include <dds/dds.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

struct ddsi_sertype;

namespace ros2 {

/// A topic of a participant, which owns it. It has no type information, so that DDS matches it by name and
/// type name alone, as it does with ROS 2; the messages of ROS 2 have no keys.
struct RawTopic {
  dds_entity_t entity = 0;
  const ddsi_sertype* type = nullptr;  ///< valid as long as the topic
};

/// A longer sample from the network is refused before memory is reserved for it.
/// `type`: as in DDS, such as "std_msgs::msg::dds_::String_". @throws hal::SetupError
RawTopic make_raw_topic(dds_entity_t participant, const std::string& name, const std::string& type,
                        std::size_t max_received_bytes);

/// `payload`: CDR with its head of four bytes. An error of DDS if the sample was not queued.
dds_return_t write_raw(dds_entity_t writer, const RawTopic& topic, std::string_view payload);

/// Each sample that waits, at most kMaxTaken, with the handle of its publisher.
inline constexpr std::uint32_t kMaxTaken = 16;
void take_raw(dds_entity_t reader,
              const std::function<void(dds_instance_handle_t publisher, std::string_view payload)>& visit);

}  // namespace ros2
