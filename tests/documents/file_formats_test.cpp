// apps/FILE_FORMATS.md: the programs read its examples, and its lists are complete.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/gap_json.h"
#include "apps/youbot_sim/fault_file.h"
#include "control/teleoperation.h"
#include "model/effects/any_effect.h"
#include "model/friction/any_law.h"
#include "operation/base_recording.h"
#include "operation/cycle_record.h"
#include "runtime/configuration/drive_model_file.h"
#include "runtime/configuration/scene_config.h"
#include "runtime/recording/column_map.h"
#include "runtime/recording/recording_reader.h"
#include "tests/documents/commands.h"
#include "tests/support/built_paths.h"
#include "tests/support/temporary_directory.h"

namespace file_formats_test {

namespace fs = std::filesystem;
const fs::path kDocument = support::source_dir() + "/apps/FILE_FORMATS.md";

std::string document() {
  std::ifstream file(kDocument);
  return {std::istreambuf_iterator<char>(file), {}};
}

bool says(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

/// The row of a table that begins with `name`, empty without one.
std::string row_of(const std::string& text, const std::string& name) {
  const std::size_t begin = text.find("\n| `" + name + "`");
  return begin == text.npos ? "" : text.substr(begin + 1, text.find('\n', begin + 1) - begin - 1);
}

class FileFormats : public testing::Test {
 protected:
  /// The example that holds this line, as a file.
  fs::path example(const std::string& line) {
    for (const documents::Block& block : documents::fenced_blocks(kDocument)) {
      if (std::ranges::count(block.lines, line) == 0) continue;
      std::string text;
      for (const std::string& each : block.lines) text += each + "\n";
      return directory_.write("example", text);
    }
    ADD_FAILURE() << "no example with " << line;
    return directory_ / "none";
  }

 private:
  support::TemporaryDirectory directory_;
};

TEST_F(FileFormats, TheExampleOfARecordingIsOne) {
  const runtime::ReadRecording read = runtime::read_recording(example("# youbot recording v1"));
  EXPECT_EQ(read.recording.rig, "wheel-1");
  EXPECT_EQ(read.recording.rows(), 1U);
  EXPECT_TRUE(read.warnings.empty()) << read.warnings[0];
}

TEST_F(FileFormats, TheExampleOfADriveModelIsOne) {
  const model::effects::DriveModel model =
      runtime::read_drive_model(example("format = \"youbot-drive-model/1\""));
  EXPECT_EQ(model.name, "wheel-1");
  EXPECT_EQ(model.effects.size(), 2U);
}

TEST_F(FileFormats, TheExampleOfAColumnMapIsOne) {
  const runtime::ColumnMap map = runtime::read_column_map(example("format = \"youbot-column-map/1\""));
  EXPECT_EQ(map.columns.size(), 3U);
  EXPECT_EQ(map.only_value, "3");
  EXPECT_EQ(map.decimal, ',');
}

TEST_F(FileFormats, TheExampleOfASceneIsOne) {
  EXPECT_EQ(runtime::load_scene(example("[[scene.wall]]")).walls.size(), 1U);
}

TEST_F(FileFormats, TheExampleOfAFaultScriptIsOne) {
  constexpr std::size_t kSlavesOfABase = 5;
  EXPECT_EQ(youbot_sim::load_faults(example("[[fault]]"), kSlavesOfABase).size(), 1U);
}

TEST_F(FileFormats, EveryEffectIsThereWithItsParameters) {
  const std::string text = document();
  for (const model::effects::EffectDescription& effect : model::effects::effect_descriptions()) {
    const std::string row = row_of(text, std::string(effect.name));
    EXPECT_FALSE(row.empty()) << effect.name;
    for (const auto& parameter : effect.parameters)
      EXPECT_TRUE(says(row, "`" + std::string(parameter.name) + "`")) << effect.name << " " << parameter.name;
    EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(row, '`')), 2 + 2 * effect.parameters.size())
        << row;
  }
}

// Rows say "those of `kfm`"; of numbered elements they have the first.
TEST_F(FileFormats, EveryFrictionLawIsThereWithItsParameters) {
  const std::string text = document();
  for (const model::effects::EffectDescription& law : model::effects::friction_law_effects()) {
    std::string rows = row_of(text, std::string(law.name));
    EXPECT_FALSE(rows.empty()) << law.name;
    for (const char* base : {"lugre", "kfm"})
      if (says(rows, "those of `" + std::string(base) + "`")) rows += row_of(text, base);
    const bool remembers = model::friction::law_description(law.name).has_memory;
    EXPECT_EQ(says(row_of(text, std::string(law.name)), "| yes |"), remembers) << law.name;
    for (const auto& parameter : law.parameters) {
      const std::size_t digit = parameter.name.find_first_of("0123456789");
      if (digit != parameter.name.npos && parameter.name.substr(digit, 2) != "1_" &&
          parameter.name.substr(digit) != "1")
        continue;
      EXPECT_TRUE(says(rows, "`" + std::string(parameter.name) + "`")) << law.name << " " << parameter.name;
    }
  }
}

TEST_F(FileFormats, EveryKeyOfGapJsonIsThere) {
  const std::string text = document();
  analysis::Findings findings;
  findings.result.rejected.push_back({"backlash", 0.1, "no better than chance"});
  const nlohmann::json json = nlohmann::json::parse(analysis::gap_json(findings));
  EXPECT_GT(json.size(), 10U);
  for (const auto& [key, value] : json["rejected"].at(0).items())
    EXPECT_TRUE(says(row_of(text, "rejected"), "`" + key + "`")) << key;
  for (const auto& [key, value] : json.items())
    EXPECT_TRUE(says(text, "`" + key + "`") || says(text, "\"" + key + "\"")) << key;
}

TEST_F(FileFormats, ThePhasesHaveTheirNumbers) {
  std::string text = document();
  std::ranges::replace(text, '\n', ' ');
  std::string base;
  for (int i = 0; i <= static_cast<int>(operation::Phase::kOff); ++i)
    base += (i == 0 ? "" : ", ") + std::to_string(i) + " " + name(static_cast<operation::Phase>(i));
  EXPECT_TRUE(says(text, base)) << base;
  std::string teleoperation;
  for (int i = 0; i <= static_cast<int>(control::TeleopPhase::kFaulted); ++i)
    teleoperation +=
        (i == 0 ? "" : ", ") + std::to_string(i) + " " + control::name(static_cast<control::TeleopPhase>(i));
  EXPECT_TRUE(says(text, teleoperation)) << teleoperation;
}

}  // namespace file_formats_test
