// `youbot-gap robot` on measured bases, by the READMEs of their folders.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

#include "runtime/configuration/base_file.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace youbot_gap_base_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string content(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

class GapBase : public testing::Test {
 protected:
  json explain(const fs::path& model, const std::string& arguments) {
    const std::string out = (directory_ / "out").string();
    const support::CommandResult result =
        support::run_command(support::program("youbot-gap") + " robot --model " + model.string() + " --out " +
                             out + " --quiet " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.output;
    return json::parse(content(fs::path(out) / "gap.json"));
  }
  static std::string list(const fs::path& folder, std::initializer_list<const char*> names) {
    std::string text;
    for (const char* const name : names) text += " " + (folder / name).string();
    return text;
  }
  /// As the name of an effect or of one that the data cannot tell from it.
  static bool is_among(const json& gap, const std::string& type, const std::string& part) {
    const auto is = [&](const json& one) { return one.at("type") == type && one.at("part") == part; };
    return std::ranges::any_of(gap.at("effects"), [&](const json& effect) {
      return is(effect) || std::ranges::any_of(effect.at("equivalent"), is);
    });
  }
  static bool is_named(const json& gap, const std::string& type) {
    return std::ranges::any_of(gap.at("effects"), [&](const json& one) { return one.at("type") == type; });
  }

  const fs::path data_ = fs::path(support::source_dir()) / "tests/data";
  support::TemporaryDirectory directory_;
};

TEST_F(GapBase, OnTwoFloorsAScaleIsWrongAndOneFloorSlips) {
  const fs::path folder = data_ / "robotino_base";
  const json gap =
      explain(folder / "robot.toml", "--data" + list(folder, {"table.csv", "brown.csv"}) + " --held-out" +
                                         list(folder, {"table_other.csv", "brown_other.csv"}));
  EXPECT_TRUE(is_among(gap, "tracking_scale", "tracking")) << gap.at("effects");
  EXPECT_TRUE(is_among(gap, "floor_slip", "brown")) << gap.at("effects");
  for (const char* const wrong : {"turning_geometry", "slip_with_load", "tracking_offset"})
    EXPECT_FALSE(is_named(gap, wrong)) << gap.at("effects");
  for (const char* const wheel : {"wheel1", "wheel2", "wheel3"})
    EXPECT_FALSE(is_among(gap, "wheel_radius", wheel)) << gap.at("effects");
  const json& places = gap.at("gap").at("units").at(0);
  EXPECT_EQ(places.at("unit"), "m");
  EXPECT_LT(places.at("after"), 0.4 * places.at("before").get<double>());
}

// The measured base with an error that is known.
TEST_F(GapBase, ATrackThatIsATenthTooShortIsNamedAndTransfersToOtherPaths) {
  const fs::path folder = data_ / "diff_drive_base";
  std::string model = content(folder / "robot.toml");
  const std::size_t at = model.find("track_m = 0.200");
  ASSERT_NE(at, std::string::npos);
  model.replace(at, std::string("track_m = 0.200").size(), "track_m = 0.180");
  const json gap = explain(
      directory_.write("robot.toml", model),
      "--data" + list(folder, {"square_231220200029.csv", "square_231220200045.csv"}) + " --held-out" +
          list(folder, {"circular_231220200154.csv", "free_030120210001.csv", "ivanjko_231220200057.csv"}));
  EXPECT_TRUE(is_named(gap, "turning_geometry")) << gap.at("effects");
  for (const char* const wrong : {"slip_forward", "tracking_offset", "tracking_scale"})
    EXPECT_FALSE(is_named(gap, wrong)) << gap.at("effects");
  const runtime::BaseFile better = runtime::read_base_file(directory_ / "out/model.toml");
  EXPECT_NEAR(better.base.turning_length_m, 0.2015, 0.003);  // published: 0.2009 to 0.2030 m
}

}  // namespace
}  // namespace youbot_gap_base_test
