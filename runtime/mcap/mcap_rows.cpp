#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "runtime/mcap/decimals.h"
#include "runtime/mcap/recording_rows.h"
#include "runtime/mcap/ros_messages.h"

namespace runtime::mcap {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

/// A topic with sensor_msgs/JointState, of one publisher or several.
struct JointTopic {
  std::set<std::uint16_t> channels;
  std::vector<std::string> joints;  // in the order of their first message
  bool has_stamps = false;          // of the measurement; otherwise all are zero
  bool has_velocity = false;
  bool has_effort = false;
};

/// What the file contains: stops at the first row of ours, otherwise reads all joint names.
class Survey : public Visitor {
 public:
  std::optional<std::uint16_t> record_channel;
  RecordingHead head;
  std::map<std::string, JointTopic> joint_topics;
  std::string library;

  bool wants_more() const override { return !record_channel; }

 private:
  void header(std::string_view, std::string_view writer) override { library = writer; }
  void metadata(std::string_view record, const StringMap& map) override {
    if (record == kRecordingMetadata) recording_ = map;
  }
  void schema(const Schema& schema) override {
    if (schema.encoding != "ros2msg") return;
    if (schema.name == kRecordType) record_schemas_.insert(schema.id);
    if (schema.name == kJointStateType) joint_schemas_.insert(schema.id);
  }
  void channel(const Channel& channel) override {
    if (channel.message_encoding != "cdr") return;
    if (record_schemas_.contains(channel.schema) && !record_channel) {
      head = head_from(recording_, channel.metadata);
      record_channel = channel.id;
    }
    if (!joint_schemas_.contains(channel.schema)) return;
    JointTopic& topic = joint_topics[std::string(channel.topic)];
    topic.channels.insert(channel.id);
    topic_of_[channel.id] = {std::string(channel.topic), &topic};
  }
  void message(const Message& message) override {
    const auto found = topic_of_.find(message.channel);
    if (found == topic_of_.end()) return;
    const JointState state = read_joint_state(message.data);
    JointTopic& topic = *found->second.second;
    topic.has_stamps |= state.stamp.ns() != 0;
    topic.has_velocity |= !state.velocity_rad_per_s.empty();
    topic.has_effort |= !state.effort_Nm.empty();
    for (const std::string& joint : state.name) {
      if (std::ranges::find(topic.joints, joint) != topic.joints.end()) continue;
      if (topic.joints.size() == kMaxJointNames)
        throw BadRecord("more than " + std::to_string(kMaxJointNames) + " joint names on " +
                        found->second.first);
      topic.joints.push_back(joint);
    }
  }

  StringMap recording_;
  std::set<std::uint16_t> record_schemas_;
  std::set<std::uint16_t> joint_schemas_;
  std::map<std::uint16_t, std::pair<std::string, JointTopic*>> topic_of_;  // by channel
};

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& each : names) list += (list.empty() ? "" : ", ") + each;
  return list;
}

class RecordRows : public Visitor {
 public:
  RecordRows(std::uint16_t channel, const RecordingHead& head, const RowVisitor& visitor)
      : channel_(channel), head_(head), visitor_(visitor), row_(head.columns.size()) {}

 private:
  void message(const Message& message) override {
    if (message.channel != channel_) return;
    read_record(message.data, row_);
    for (std::size_t i = 0; i < row_.size(); ++i)
      if (head_.columns[i].decimals) row_[i] = rounded_to_decimal(row_[i], *head_.columns[i].decimals);
    visitor_.row(row_);
  }

  std::uint16_t channel_;
  const RecordingHead& head_;
  const RowVisitor& visitor_;
  std::vector<double> row_;
};

class JointRows : public Visitor {
 public:
  JointRows(const JointTopic& topic, std::vector<std::string> joints, const RowVisitor& visitor)
      : topic_(topic), joints_(std::move(joints)), visitor_(visitor) {}

 private:
  void message(const Message& message) override {
    if (!topic_.channels.contains(message.channel)) return;
    const JointState state = read_joint_state(message.data);
    if (message.log_time_ns > kLastTime_ns) throw BadRecord("a log time beyond the year 2262");
    const std::int64_t time_ns =
        topic_.has_stamps ? state.stamp.ns() : static_cast<std::int64_t>(message.log_time_ns);
    if (!first_time_ns_) first_time_ns_ = time_ns;
    row_.assign(1, static_cast<double>(time_ns - *first_time_ns_) / 1e9);
    bool any = false;
    for (const std::string& joint : joints_) {
      const auto found = std::ranges::find(state.name, joint);
      any |= found != state.name.end();
      const auto i = static_cast<std::size_t>(found - state.name.begin());
      const auto value = [&](const std::vector<double>& values) {
        row_.push_back(i < values.size() ? values[i] : kMissing);
      };
      value(state.position_rad);
      if (topic_.has_velocity) value(state.velocity_rad_per_s);
      if (topic_.has_effort) value(state.effort_Nm);
    }
    if (any) visitor_.row(row_);  // several publishers may share a topic
  }

  static constexpr std::uint64_t kLastTime_ns = std::numeric_limits<std::int64_t>::max();

  const JointTopic& topic_;
  std::vector<std::string> joints_;
  const RowVisitor& visitor_;
  std::optional<std::int64_t> first_time_ns_;
  std::vector<double> row_;
};

/// A name that a column of a recording may have.
std::string column_name(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c <= ' ' || c == ',' || c == '#' || c == '"' || c == '\x7f'; }, '_');
  return text;
}

/// What `wanted` becomes beside the columns that there are.
std::string distinct(const RecordingHead& head, const std::string& wanted) {
  std::string name = wanted;
  for (int i = 2; head.column(name); ++i) name = wanted + "_" + std::to_string(i);
  return name;
}

RecordingHead head_of(const std::string& name, const JointTopic& topic,
                      const std::vector<std::string>& joints, const std::string& library) {
  RecordingHead head;
  std::string source = name + (library.empty() ? "" : ", written by " + library);
  std::ranges::replace_if(
      source, [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, ' ');
  if (joints.size() == 1) head.comments.push_back({"rig", column_name(joints.front())});
  head.comments.push_back({"converted_from", source});
  head.columns.push_back({"time_s"});
  for (const std::string& joint : joints) {
    const std::string prefix = joints.size() == 1 ? "" : column_name(joint) + '_';
    head.columns.push_back({distinct(head, prefix + "position_rad")});
    if (topic.has_velocity) head.columns.push_back({distinct(head, prefix + "velocity_rad_per_s")});
    if (topic.has_effort) head.columns.push_back({distinct(head, prefix + "torque_measured_Nm")});
  }
  return head;
}

const std::pair<const std::string, JointTopic>& chosen_topic(const Survey& survey, const std::string& file) {
  std::vector<std::string> topics;
  const std::pair<const std::string, JointTopic>* chosen = nullptr;
  const std::pair<const std::string, JointTopic>* usual = nullptr;
  for (const auto& each : survey.joint_topics) {
    if (each.second.joints.empty()) continue;
    chosen = &each;
    if (each.first == "/joint_states") usual = &each;
    topics.push_back(each.first);
  }
  if (topics.empty())
    throw ConfigError(
        {file + ": contains neither a recording of this software nor sensor_msgs/JointState in CDR"});
  if (topics.size() > 1 && usual == nullptr)
    throw ConfigError({file + ": has joint states on " + listed(topics) + ", but none on /joint_states"});
  return usual != nullptr ? *usual : *chosen;
}

}  // namespace

namespace {

void read_rows(const std::function<ReadBytes()>& open, const std::string& file, const JointChoice& choice,
               const RowVisitor& visitor) {
  Survey survey;
  read_mcap(open(), file, survey);
  if (survey.record_channel) {
    visitor.head(survey.head);
    RecordRows rows(*survey.record_channel, survey.head, visitor);
    read_mcap(open(), file, rows);
    return;
  }
  const auto& [name, topic] = chosen_topic(survey, file);
  std::vector<std::string> joints = topic.joints;
  if (!choice.joint.empty()) {
    if (std::ranges::find(joints, choice.joint) == joints.end())
      throw ConfigError({file + ": has no joint '" + choice.joint + "'; it has " + listed(joints)});
    joints = {choice.joint};
  } else if (joints.size() > 1 && !choice.all) {
    throw ConfigError({file + ": has the joints " + listed(joints) + "; choose one of them (--joint)"});
  }
  visitor.head(head_of(name, topic, joints, survey.library));
  JointRows rows(topic, joints, visitor);
  read_mcap(open(), file, rows);
}

}  // namespace

void read_mcap_rows(const std::function<ReadBytes()>& open, const std::string& file,
                    const JointChoice& choice, const RowVisitor& visitor) {
  try {
    read_rows(open, file, choice, visitor);
  } catch (const TornMcap& error) {
    throw ConfigError({std::string(error.what()) + "; youbotctl recover repairs it"});
  }
}

}  // namespace runtime::mcap
