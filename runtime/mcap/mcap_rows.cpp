#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "runtime/mcap/recording_rows.h"
#include "runtime/mcap/ros_messages.h"
#include "runtime/recording/recording_reader.h"

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
  std::optional<std::uint16_t> rows_channel;
  RecordingHead head;
  std::map<std::string, JointTopic> joint_topics;
  std::string library;

  bool wants_more() const override { return !rows_channel; }

 private:
  void header(std::string_view, std::string_view writer) override { library = writer; }
  void metadata(std::string_view record, const StringMap& map) override {
    if (record == kRecordingMetadata) recording_ = map;
  }
  void schema(const Schema& schema) override {
    if (schema.encoding != "ros2msg") return;
    if (schema.name == kRowsType) rows_schemas_.insert(schema.id);
    if (schema.name == kJointStateType) joint_schemas_.insert(schema.id);
  }
  void channel(const Channel& channel) override {
    if (channel.message_encoding != "cdr") return;
    if (rows_schemas_.contains(channel.schema) && !rows_channel) {
      head = head_from(recording_, channel.metadata);
      rows_channel = channel.id;
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
  std::set<std::uint16_t> rows_schemas_;
  std::set<std::uint16_t> joint_schemas_;
  std::map<std::uint16_t, std::pair<std::string, JointTopic*>> topic_of_;  // by channel
};

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& each : names) list += (list.empty() ? "" : ", ") + each;
  return list;
}

/// What a caller gets of a recording of ours: every column, or those of one joint.
struct Selection {
  RecordingHead head;
  std::vector<std::size_t> columns;
};

Selection all_of(const RecordingHead& head) {
  Selection all{head, {}};
  for (std::size_t i = 0; i < head.columns.size(); ++i) all.columns.push_back(i);
  return all;
}

/// wheel_1_position_rad becomes position_rad of the rig wheel-1, and so on: the columns that a recording of
/// this joint alone has.
Selection joint_of(const RecordingHead& head, const std::string& wanted, const std::string& file) {
  const auto rig_name = [](std::string name) {
    std::ranges::replace(name, '_', '-');
    return name;
  };
  std::vector<std::string> names;
  for (const JointColumns& joint : joints_of(head)) {
    names.push_back(joint.joint);
    if (rig_name(joint.joint) != rig_name(wanted)) continue;
    if (head.columns[joint.position].name == "position_rad") return all_of(head);
    Selection selection{{head.comments, {}}, {}};
    for (RecordingFile::Comment& comment : selection.head.comments)
      if (comment.key == "rig") comment.value = rig_name(joint.joint);
    const std::string prefix = joint.joint + '_';
    for (std::size_t i = 0; i < head.columns.size(); ++i) {
      RecordingFile::Column column = head.columns[i];
      if (column.name.starts_with(prefix))
        column.name.erase(0, prefix.size());
      else if (column.name != "time_s")
        continue;
      if (!is_known_column(column.name)) continue;
      selection.columns.push_back(i);
      selection.head.columns.push_back(std::move(column));
    }
    return selection;
  }
  throw ConfigError({file + ": has no joint '" + wanted + "'; it has " + listed(names)});
}

/// @throws ConfigError if the recording is of several drives.
void require_one_drive(const RecordingHead& head, const std::string& file) {
  std::vector<std::string> names;
  for (const JointColumns& joint : joints_of(head)) names.push_back(joint.joint);
  if (names.size() > 1)
    throw ConfigError({file + ": has the joints " + listed(names) + "; choose one of them (--joint)"});
}

class RecordRows : public Visitor {
 public:
  RecordRows(std::uint16_t channel, const RecordingHead& head, const Selection& selection,
             const RowVisitor& visitor)
      : channel_(channel), selection_(selection), visitor_(visitor), row_(selection.columns.size()) {
    for (const RecordingFile::Column& column : head.columns) decimals_.push_back(column.decimals);
  }

 private:
  void message(const Message& message) override {
    if (message.channel != channel_) return;
    const std::vector<double> rows = read_rows(message.data, decimals_);
    for (std::size_t at = 0; at < rows.size(); at += decimals_.size()) {
      for (std::size_t i = 0; i < row_.size(); ++i) row_[i] = rows[at + selection_.columns[i]];
      visitor_.row(row_);
    }
  }

  std::uint16_t channel_;
  const Selection& selection_;
  const RowVisitor& visitor_;
  std::vector<std::optional<int>> decimals_;
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

void read_mcap_rows(const std::function<ReadBytes()>& open, const std::string& file,
                    const JointChoice& choice, const RowVisitor& visitor) {
  Survey survey;
  std::string torn;  // how the file ends, if it is not complete
  const auto read = [&](Visitor& pass) {
    try {
      read_mcap(open(), file, pass);
    } catch (const TornMcap& error) {
      torn = error.what();
    }
  };
  const auto report_torn = [&] {
    if (!torn.empty() && visitor.warning)
      visitor.warning(torn + "; what precedes was read; youbotctl recover completes the file");
  };
  read(survey);
  if (survey.rows_channel) {
    if (choice.one_drive && choice.joint.empty()) require_one_drive(survey.head, file);
    const Selection selection =
        choice.joint.empty() ? all_of(survey.head) : joint_of(survey.head, choice.joint, file);
    visitor.head(selection.head);
    RecordRows rows(*survey.rows_channel, survey.head, selection, visitor);
    read(rows);
    report_torn();
    return;
  }
  if (!torn.empty() && survey.joint_topics.empty()) throw ConfigError({torn});
  const auto& [name, topic] = chosen_topic(survey, file);
  if (survey.library.starts_with("youbot-hal") && visitor.warning)
    visitor.warning("the recording's own rows are damaged; read " + name + ", which has fewer of them");
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
  read(rows);
  report_torn();
}

}  // namespace runtime::mcap
