// --json: machine-readable output of scan, diagnose, parameters and --check.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"

namespace json_output_test {

using nlohmann::json;
using support::CommandResult;

CommandResult run(const std::string& command) {
  return support::run_command(support::program_dir() + "/" + command + " 2>/dev/null");
}

TEST(JsonOutput, AScanHasEverySlave) {
  const CommandResult scan = run("youbot-bench scan --robot wire --json");
  ASSERT_EQ(scan.exit_code, 0);
  const json result = json::parse(scan.output);
  EXPECT_EQ(result["kind"], "base+arm");
  EXPECT_EQ(result["complete"], true);
  ASSERT_EQ(result["slaves"].size(), 11U);
  const json& wheel = result["slaves"][1];
  EXPECT_EQ(wheel["position"], 2);
  EXPECT_EQ(wheel["name"], "TMCM-1632");
  EXPECT_EQ(wheel["vendor"], 0x286) << "Trinamic";
  EXPECT_EQ(wheel["behind_slave"], 1);
  EXPECT_EQ(wheel["protocols"], json::array());
}

TEST(JsonOutput, ADiagnosisHasCountersAndPorts) {
  const CommandResult diagnosis = run("youbot-bench diagnose --robot wire --duration 0.2 --json");
  ASSERT_EQ(diagnosis.exit_code, 0);
  const json result = json::parse(diagnosis.output);
  EXPECT_EQ(result["sound"], true);
  EXPECT_EQ(result["frames"]["lost"], 0);
  EXPECT_GE(result["frames"]["sent"], 200);
  ASSERT_EQ(result["slaves"].size(), 11U);
  EXPECT_EQ(result["slaves"][10]["ports"][0]["up"], true);
  EXPECT_EQ(result["slaves"][10]["ports"][1]["up"], false) << "the last one";
}

TEST(JsonOutput, ParametersHaveNumbersAndUnits) {
  const CommandResult parameters = run("youbot-bench parameters --robot wire --joint wheel-1 --json");
  ASSERT_EQ(parameters.exit_code, 0);
  bool found = false;
  for (const json& parameter : json::parse(parameters.output)) {
    EXPECT_EQ(parameter["joint"], "wheel-1");
    if (parameter["parameter"] != "motor_acceleration") continue;
    found = true;
    EXPECT_EQ(parameter["number"], 11);
    EXPECT_EQ(parameter["value"], 2000);
    EXPECT_EQ(parameter["unit"], "rpm/s");
  }
  EXPECT_TRUE(found);
}

TEST(JsonOutput, ACheckHasAMarkForEachFinding) {
  const std::string config = " --config " + support::source_dir() + "/apps/youbotd/demo.toml";
  const CommandResult check = run("youbotd --check --json" + config);
  const json findings = json::parse(check.output);
  ASSERT_FALSE(findings.empty());
  bool failed = false;
  for (const json& finding : findings) {
    EXPECT_TRUE(finding["mark"] == "ok" || finding["mark"] == "warn" || finding["mark"] == "fail");
    failed = failed || finding["mark"] == "fail";
  }
  EXPECT_EQ(findings[0]["found"], "configuration: loopback");
  EXPECT_EQ(check.exit_code, failed ? 3 : 0);
  EXPECT_EQ(run("youbotd --json" + config).exit_code, 2) << "of a run there is none";
}

}  // namespace json_output_test
