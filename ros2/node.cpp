#include "ros2/node.h"

#include <spdlog/fmt/fmt.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <span>
#include <utility>

#include "hal/setup_error.h"
#include "runtime/log.h"
#include "runtime/mcap/cdr.h"

namespace ros2 {
namespace {

constexpr const char* kGraphTopic = "ros_discovery_info";
constexpr const char* kGraphType = "rmw_dds_common/msg/ParticipantEntitiesInfo";
constexpr const char* kGraphHash = "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e";

/// What ours adds to the defaults of Cyclone DDS. The threads' stacks are locked in memory with the rest of
/// the program, so they are small.
std::string configuration() {
  std::string threads;
  for (const char* name : {"recv", "tev", "gc", "lease", "dq.builtins", "dq.user"})
    threads += fmt::format("<Thread name=\"{}\"><StackSize>512 kB</StackSize></Thread>", name);
  std::string text = fmt::format(
      "<CycloneDDS><Domain id=\"any\"><Internal><MaxSampleSize>{} B</MaxSampleSize></Internal>"
      "<Threads>{}</Threads></Domain></CycloneDDS>",
      kMaxSample_bytes, threads);
  // The user's settings come later and count.
  if (const char* const users = std::getenv("CYCLONEDDS_URI"); users != nullptr && *users != '\0')
    text += std::string(",") + users;
  return text;
}

/// Problems that Cyclone DDS reports, on its threads. What others send can cause many: one line a second.
void log_problem(void* /*unused*/, const dds_log_data_t* problem) {
  if ((problem->priority & (DDS_LC_FATAL | DDS_LC_ERROR | DDS_LC_WARNING)) == 0) return;
  static std::atomic<std::chrono::steady_clock::rep> last{0};
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  auto before = last.load();
  if (before != 0 && now - std::chrono::steady_clock::duration(before) < std::chrono::seconds(1)) return;
  if (!last.compare_exchange_strong(before, now.count())) return;
  std::string_view text(problem->message, problem->size);
  while (text.ends_with('\n')) text.remove_suffix(1);
  spdlog::warn("ros2: {}", text);
}

/// "sensor_msgs/msg/JointState" is sensor_msgs::msg::dds_::JointState_ in DDS.
std::string dds_type(std::string_view type) {
  std::string name;
  for (std::size_t slash; (slash = type.find('/')) != std::string_view::npos; type.remove_prefix(slash + 1))
    name += std::string(type.substr(0, slash)) + "::";
  return name + "dds_::" + std::string(type) + "_";
}

std::string dds_topic(const std::string& topic) { return "rt" + topic; }

dds_entity_t made(dds_entity_t entity, const std::string& what) {
  if (entity < 0)
    throw hal::SetupError("ros2: " + what, dds_strretcode(entity),
                          "check the network, CYCLONEDDS_URI, and the domain of --ros2");
  return entity;
}

/// Quality of service, freed with this object.
class Qos {
 public:
  Qos() = default;
  Qos(const Qos&) = delete;
  Qos& operator=(const Qos&) = delete;
  ~Qos() { dds_delete_qos(qos_); }
  dds_qos_t* get() const { return qos_; }

  void user_data(const std::string& text) const { dds_qset_userdata(qos_, text.data(), text.size()); }
  void of_type(const std::string& hash) const {
    user_data("typehash=" + hash + ";");
    const dds_data_representation_id_t cdr = DDS_DATA_REPRESENTATION_XCDR1;
    dds_qset_data_representation(qos_, 1, &cdr);
  }
  /// As publishers of ROS 2 by default, but without waiting for subscribers.
  void reliable(bool latched) const {
    dds_qset_reliability(qos_, DDS_RELIABILITY_RELIABLE, 0);
    dds_qset_durability(qos_, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos_, DDS_HISTORY_KEEP_LAST, latched ? 1 : kMaxQueued);
    if (latched)
      dds_qset_durability_service(qos_, 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                                  DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }

 private:
  dds_qos_t* qos_ = dds_create_qos();
};

std::span<const std::uint8_t> gid_of(dds_entity_t entity, dds_guid_t& guid) {
  made(dds_get_guid(entity, &guid), "GUID");
  return guid.v;
}

void write_gid(runtime::mcap::CdrWriter& cdr, dds_entity_t entity) {
  dds_guid_t guid;
  for (const std::uint8_t byte : gid_of(entity, guid)) cdr.number(byte);
}

}  // namespace

struct Node::Subscription {
  dds_entity_t reader = 0;
  Listen listen;

  static void hear(dds_entity_t reader, void* subscription) {
    take_raw(reader, static_cast<Subscription*>(subscription)->listen);
  }
};

Node::Node(std::uint32_t domain, std::string name) : name_(std::move(name)) {
  dds_set_log_sink(log_problem, nullptr);
  domain_ = made(dds_create_domain(domain, configuration().c_str()), "domain " + std::to_string(domain));
  Qos qos;
  qos.user_data("enclave=/;");
  participant_ = dds_create_participant(domain, qos.get(), nullptr);
  if (participant_ < 0) {
    dds_delete(domain_);
    made(participant_, "domain " + std::to_string(domain));
  }
}

Node::~Node() {
  dds_delete(domain_);
  dds_set_log_sink(nullptr, nullptr);
}

std::size_t Node::add(live::Channel channel) {
  Publisher publisher{.latched = channel.latched};
  if (!channel.type_hash.empty()) {
    publisher.topic = make_raw_topic(participant_, dds_topic(channel.topic), dds_type(channel.schema_name),
                                     kMaxSample_bytes);
    Qos qos;
    qos.of_type(channel.type_hash);
    qos.reliable(channel.latched);
    publisher.writer =
        made(dds_create_writer(participant_, publisher.topic.entity, qos.get(), nullptr), channel.topic);
  }
  publishers_.push_back(publisher);
  return publishers_.size() - 1;
}

void Node::subscribe(const std::string& topic, const live::ros::Type& type, std::size_t max_bytes,
                     Listen listen) {
  const RawTopic raw = make_raw_topic(participant_, dds_topic(topic), dds_type(type.name), max_bytes);
  Qos qos;
  qos.of_type(std::string(type.hash));
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, static_cast<std::int32_t>(kMaxTaken));
  const auto& subscription = subscriptions_.emplace_back(std::make_unique<Subscription>());
  subscription->listen = std::move(listen);
  dds_listener_t* const listener = dds_create_listener(subscription.get());
  dds_lset_data_available(listener, Subscription::hear);
  const dds_entity_t reader = dds_create_reader(participant_, raw.entity, qos.get(), listener);
  dds_delete_listener(listener);
  subscription->reader = made(reader, topic);
}

void Node::announce() {
  const RawTopic topic = make_raw_topic(participant_, kGraphTopic, dds_type(kGraphType), kMaxSample_bytes);
  Qos qos;
  qos.of_type(kGraphHash);
  qos.reliable(/*latched=*/true);
  const dds_entity_t writer =
      made(dds_create_writer(participant_, topic.entity, qos.get(), nullptr), kGraphTopic);
  runtime::mcap::CdrWriter cdr;
  write_gid(cdr, participant_);
  cdr.count(1);  // nodes
  cdr.string("/");
  cdr.string(name_);
  cdr.count(subscriptions_.size());
  for (const auto& subscription : subscriptions_) write_gid(cdr, subscription->reader);
  std::size_t writers = 0;
  for (const Publisher& publisher : publishers_) writers += publisher.writer != 0 ? 1 : 0;
  cdr.count(writers);
  for (const Publisher& publisher : publishers_)
    if (publisher.writer != 0) write_gid(cdr, publisher.writer);
  made(write_raw(writer, topic, cdr.payload()), kGraphTopic);
}

bool Node::wanted(std::size_t channel) const {
  const Publisher& publisher = publishers_[channel];
  if (publisher.writer == 0) return false;
  dds_publication_matched_status_t matched{};
  return publisher.latched ||
         (dds_get_publication_matched_status(publisher.writer, &matched) == DDS_RETCODE_OK &&
          matched.current_count > 0);
}

void Node::publish(std::size_t channel, std::uint64_t /*time_ns*/, std::string_view payload) {
  const Publisher& publisher = publishers_[channel];
  if (publisher.writer == 0) return;
  if (write_raw(publisher.writer, publisher.topic, payload) != DDS_RETCODE_OK) ++refused_;
}

std::string Node::gid(std::size_t i, std::uint64_t publisher) const {
  dds_builtintopic_endpoint_t* const found =
      dds_get_matched_publication_data(subscriptions_[i]->reader, publisher);
  if (found == nullptr) return "a publisher that is gone";
  std::string text = fmt::format("{:02x}", fmt::join(found->key.v, "."));
  dds_builtintopic_free_endpoint(found);
  return text;
}

}  // namespace ros2
