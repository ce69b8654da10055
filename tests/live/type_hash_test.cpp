// The type hashes of ROS 2 against the definitions that are streamed beside them: RIHS01 of REP 2011 is the
// SHA-256 of a description of the type and of each type in it, as JSON.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "live/ros_messages.h"
#include "runtime/mcap/ros_messages.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace type_hash_test {

struct Field {
  std::string type;
  std::string name;
};
using Types = std::map<std::string, std::vector<Field>>;  // by full name

std::string full_name(const std::string& type, const std::string& package) {
  const auto slash = type.find('/');
  if (slash == std::string::npos) return package + "/msg/" + type;
  return type.substr(0, slash) + "/msg/" + type.substr(slash + 1);
}

std::string package_of(const std::string& full) { return full.substr(0, full.find('/')); }

/// Lines of "type name", parts with "MSG: package/Type" and lines of "=" between them; constants are no part
/// of the hash.
Types read(const std::string& full, const std::string& definition) {
  Types types;
  std::string current = full;
  std::istringstream lines(definition);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '=' || line[0] == '#') continue;
    if (line.starts_with("MSG: ")) {
      current = full_name(line.substr(5), "");
      continue;
    }
    std::istringstream words(line);
    Field field;
    words >> field.type >> field.name;
    if (field.name.find('=') == std::string::npos) types[current].push_back(field);
  }
  return types;
}

/// Numbers of type_description_interfaces/FieldType.
const std::map<std::string, int> kPrimitives{{"uint8", 3},    {"int32", 6}, {"uint32", 7}, {"int64", 8},
                                             {"float64", 11}, {"byte", 16}, {"string", 17}};
constexpr int kNested = 1;
constexpr int kArray = 48;
constexpr int kUnboundedSequence = 144;

struct Description {
  std::string json;
  std::set<std::string> nested;
};

Description describe(const std::string& full, const Types& types) {
  Description all;
  for (const Field& field : types.at(full)) {
    std::string type = field.type;
    int offset = 0;
    std::string capacity = "0";
    if (const auto bracket = type.find('['); bracket != std::string::npos) {
      const std::string count = type.substr(bracket + 1, type.size() - bracket - 2);
      offset = count.empty() ? kUnboundedSequence : kArray;
      if (!count.empty()) capacity = count;
      type.resize(bracket);
    }
    const auto primitive = kPrimitives.find(type);
    std::string nested;
    if (primitive == kPrimitives.end()) all.nested.insert(nested = full_name(type, package_of(full)));
    const int id = offset + (nested.empty() ? primitive->second : kNested);
    all.json += std::string(all.json.empty() ? "" : ", ") + "{\"name\": \"" + field.name +
                "\", \"type\": {\"type_id\": " + std::to_string(id) + ", \"capacity\": " + capacity +
                ", \"string_capacity\": 0, \"nested_type_name\": \"" + nested + "\"}}";
  }
  all.json = "{\"type_name\": \"" + full + "\", \"fields\": [" + all.json + "]}";
  return all;
}

void collect(const std::string& full, const Types& types, std::set<std::string>& found) {
  for (const std::string& nested : describe(full, types).nested)
    if (found.insert(nested).second) collect(nested, types, found);
}

std::string hash_of(const std::string& full, const std::string& definition) {
  const Types types = read(full, definition);
  std::set<std::string> nested;
  collect(full, types, nested);
  std::string referenced;
  for (const std::string& name : nested)
    referenced += (referenced.empty() ? "" : ", ") + describe(name, types).json;
  const support::TemporaryDirectory folder;
  const std::string file =
      folder.write("type.json", "{\"type_description\": " + describe(full, types).json +
                                    ", \"referenced_type_descriptions\": [" + referenced + "]}");
  return "RIHS01_" + support::run_command("sha256sum <" + file).output.substr(0, 64);
}

TEST(TypeHash, IsThatOfTheDefinition) {
  namespace ros = live::ros;
  for (const ros::Type* type : {&ros::kPoseStamped, &ros::kWrenchStamped, &ros::kOdometry, &ros::kTransforms,
                                &ros::kDiagnosticArray, &ros::kTwist, &ros::kTwistStamped, &ros::kString})
    EXPECT_EQ(hash_of(std::string(type->name), type->definition()), type->hash) << type->name;
  EXPECT_EQ(
      hash_of(std::string(runtime::mcap::kJointStateType), std::string(runtime::mcap::kJointStateDefinition)),
      ros::kJointStateHash);
}

/// As `ros2 topic info --verbose` prints it on ROS 2 Jazzy.
TEST(TypeHash, OfATwistIsThePublishedOne) {
  EXPECT_EQ(hash_of("geometry_msgs/msg/Twist",
                    "Vector3 linear\nVector3 angular\n====\nMSG: geometry_msgs/Vector3\nfloat64 x\n"
                    "float64 y\nfloat64 z\n"),
            "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a");
}

}  // namespace type_hash_test
