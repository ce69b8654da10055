/// @file
/// A participant of Fast DDS, which knows nothing of our code: what it discovers, and messages as bytes.
#pragma once
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>

#include <chrono>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace other_dds {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

/// Serialized bytes with their head, as they are.
class Bytes final : public dds::TopicDataType {
 public:
  Bytes(const std::string& type, std::uint32_t max_bytes) {
    setName(type.c_str());
    m_typeSize = max_bytes;
    m_isGetKeyDefined = false;
    auto_fill_type_information(false);
    auto_fill_type_object(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<const std::string*>(data);
    if (bytes.size() > payload->max_size) return false;
    payload->encapsulation = CDR_LE;
    payload->length = static_cast<std::uint32_t>(bytes.size());
    std::memcpy(payload->data, bytes.data(), bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<std::string*>(data)->assign(reinterpret_cast<const char*>(payload->data), payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const std::string*>(data)->size()); };
  }
  void* createData() override { return new std::string; }
  void deleteData(void* data) override { delete static_cast<std::string*>(data); }
  bool getKey(void* /*data*/, rtps::InstanceHandle_t* /*key*/, bool /*md5*/) override { return false; }
};

inline std::string gid_of(const rtps::GUID_t& guid) {
  std::string gid(reinterpret_cast<const char*>(guid.guidPrefix.value), 12);
  return gid + std::string(reinterpret_cast<const char*>(guid.entityId.value), 4);
}

struct Endpoint {
  std::string topic;
  std::string type;
  std::string user_data;
  std::string gid;
  bool reliable = false;
  bool latched = false;
};

class Participant final : public dds::DomainParticipantListener {
 public:
  explicit Participant(std::uint32_t domain) {
    dds::DomainParticipantQos qos;
    // No shared memory: only the network between the namespaces.
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(
        std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>());
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(domain, qos, this,
                                                                                     dds::StatusMask::none());
    publisher_ = participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
    subscriber_ = participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT);
  }
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;
  ~Participant() override {
    participant_->set_listener(nullptr);
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }

  // What it has discovered.
  std::map<std::string, Endpoint> publishers() const {
    const std::lock_guard lock(mutex_);
    return publishers_;
  }
  std::map<std::string, Endpoint> subscriptions() const {
    const std::lock_guard lock(mutex_);
    return subscriptions_;
  }
  /// User data by GID.
  std::map<std::string, std::string> participants() const {
    const std::lock_guard lock(mutex_);
    return participants_;
  }

  /// As a subscription of ROS 2 asks for by default, or also for the last message before.
  dds::DataReader* subscribe(const std::string& topic, const std::string& type, bool latched = false) {
    dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().depth = 10;
    return subscriber_->create_datareader(make_topic(topic, type), qos);
  }
  /// As a publisher of ROS 2 by default.
  dds::DataWriter* advertise(const std::string& topic, const std::string& type) {
    dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind = dds::VOLATILE_DURABILITY_QOS;
    qos.history().depth = 10;
    qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;  // as more than a datagram needs
    return publisher_->create_datawriter(make_topic(topic, type), qos);
  }

 private:
  dds::Topic* make_topic(const std::string& topic, const std::string& type) {
    constexpr std::uint32_t kMax_bytes = 4 << 20;
    dds::TypeSupport(new Bytes(type, kMax_bytes)).register_type(participant_);
    return participant_->create_topic(topic, type, dds::TOPIC_QOS_DEFAULT);
  }
  template <typename Data>
  static std::string text(const Data& octets) {
    return {octets.begin(), octets.end()};
  }
  template <typename Proxy>
  static Endpoint endpoint(const Proxy& info) {
    return {.topic = info.topicName().to_string(),
            .type = info.typeName().to_string(),
            .user_data = text(info.m_qos.m_userData),
            .gid = gid_of(info.guid()),
            .reliable = info.m_qos.m_reliability.kind == dds::RELIABLE_RELIABILITY_QOS,
            .latched = info.m_qos.m_durability.kind == dds::TRANSIENT_LOCAL_DURABILITY_QOS};
  }
  void on_participant_discovery(dds::DomainParticipant* /*own*/,
                                rtps::ParticipantDiscoveryInfo&& info) override {
    const std::lock_guard lock(mutex_);
    if (info.status == rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT)
      participants_[gid_of(info.info.m_guid)] = text(info.info.m_userData);
  }
  void on_publisher_discovery(dds::DomainParticipant* /*own*/, rtps::WriterDiscoveryInfo&& info) override {
    const std::lock_guard lock(mutex_);
    if (info.status != rtps::WriterDiscoveryInfo::DISCOVERED_WRITER) return;
    const Endpoint found = endpoint(info.info);
    publishers_[found.topic] = found;
  }
  void on_subscriber_discovery(dds::DomainParticipant* /*own*/, rtps::ReaderDiscoveryInfo&& info) override {
    const std::lock_guard lock(mutex_);
    if (info.status != rtps::ReaderDiscoveryInfo::DISCOVERED_READER) return;
    const Endpoint found = endpoint(info.info);
    subscriptions_[found.topic] = found;
  }

  dds::DomainParticipant* participant_ = nullptr;
  dds::Publisher* publisher_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  mutable std::mutex mutex_;
  std::map<std::string, Endpoint> publishers_;
  std::map<std::string, Endpoint> subscriptions_;
  std::map<std::string, std::string> participants_;
};

/// Repeats `is_so` until it is; the test has its time-out.
inline void wait_until(const std::function<bool()>& is_so) {
  while (!is_so()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

/// The next message, with its head.
inline std::string next(dds::DataReader& reader) {
  std::string payload;
  dds::SampleInfo info;
  wait_until([&] {
    return reader.take_next_sample(&payload, &info) == ReturnCode_t::RETCODE_OK && info.valid_data;
  });
  return payload;
}
/// The newest message, of those that wait or of one that comes.
inline std::string newest(dds::DataReader& reader) {
  std::string payload = next(reader);
  std::string later;
  dds::SampleInfo info;
  while (reader.take_next_sample(&later, &info) == ReturnCode_t::RETCODE_OK)
    if (info.valid_data) payload = later;
  return payload;
}

}  // namespace other_dds
