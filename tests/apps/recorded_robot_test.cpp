// Violations of the rules in a record of youbot-sim are found: one inserted row for each rule.
#include "tests/support/recorded_robot.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/temporary_directory.h"

namespace recorded_robot_test {

/// Mode and target of a wheel and of an arm joint in a row.
struct Row {
  int wheel_mode = 0;
  double wheel_target = 0;
  int arm_mode = 0;
  double arm_target_rad = 1;
};

/// Of 30 rows: still, driving from row 10 to 19 with the arm holding its place, still.
std::vector<std::string> violations_with(const std::function<void(std::vector<Row>&)>& defect,
                                         int enables = 1) {
  std::vector<Row> rows(30);
  for (std::size_t n = 10; n < 20; ++n) rows[n] = {6, 0.5, 1, 1.0};
  defect(rows);
  std::string text = "# rig: youbot-sim\ntime_s";
  for (int i = 1; i <= 4; ++i)
    for (const char* end : {"_mode", "_target", "_position_rad", "_encoder_rad"})
      text += ",wheel_" + std::to_string(i) + end;
  for (int i = 1; i <= 5; ++i)
    for (const char* end : {"_mode", "_target", "_position_rad", "_encoder_rad"})
      text += ",arm_" + std::to_string(i) + end;
  for (std::size_t n = 0; n < rows.size(); ++n) {
    text += "\n" + std::to_string(0.001 * static_cast<double>(n));
    for (int i = 0; i < 4; ++i)
      text += i == 0 ? "," + std::to_string(rows[n].wheel_mode) + "," + std::to_string(rows[n].wheel_target) +
                           ",0,0"
                     : ",0,0,0,0";
    for (int i = 0; i < 5; ++i)
      text += i == 0 ? "," + std::to_string(rows[n].arm_mode) + "," + std::to_string(rows[n].arm_target_rad) +
                           ",1,1"
                     : ",0,0,0,0";
  }
  const support::TemporaryDirectory folder;
  return support::violations_of_record(support::Recording(folder.write("seen.csv", text + "\n")), enables);
}

void expect_found(const std::vector<std::string>& violations, const std::string& part) {
  ASSERT_EQ(violations.size(), 1U);
  EXPECT_NE(violations[0].find(part), std::string::npos) << violations[0];
}

TEST(RecordedRobot, ARunWithinTheRulesHasNoViolation) {
  EXPECT_EQ(violations_with([](auto&) {}), std::vector<std::string>{});
  // A wheel that its own watchdog holds is not commanded.
  EXPECT_EQ(violations_with([](auto& rows) { rows[29] = rows[25] = {1, 0.0}; }), std::vector<std::string>{});
}

TEST(RecordedRobot, EachRuleIsBrokenByARow) {
  const auto row = [](std::size_t n, Row planted) {
    return [n, planted](std::vector<Row>& rows) { rows[n] = planted; };
  };
  expect_found(violations_with([](auto&) {}, 0), "starts to move once more than it was enabled");
  expect_found(violations_with(row(25, {6, 0.5})), "starts to move once more than it was enabled");
  EXPECT_EQ(violations_with(row(25, {6, 0.5}), 2), std::vector<std::string>{});
  expect_found(violations_with(row(29, {6, 0.5}), 2), "is commanded at its end");
  expect_found(violations_with(row(12, {6, 2.6})), "wheel-1 is commanded 2.6");
  expect_found(violations_with(row(12, {2, -17.0})), "wheel-1 is commanded -17.0");
  expect_found(violations_with(row(12, {6, 0.5, 1, 5.95})), "arm-1 is commanded 5.95");
}

TEST(RecordedRobot, ADriveThatRestsInARunAndIsCommandedAgainIsFound) {
  // The arm's joint keeps the run going while the wheel stops.
  const auto violations = violations_with([](std::vector<Row>& rows) {
    for (std::size_t n = 10; n < 20; ++n) rows[n].arm_mode = 6;
    for (std::size_t n = 13; n < 16; ++n) rows[n].wheel_mode = 0;
  });
  expect_found(violations, "wheel-1 is commanded again in a run that stopped it");
}

}  // namespace recorded_robot_test
