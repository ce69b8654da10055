// Every numeric option of every program rejects non-numbers: "nan" passes any range check that compares with
// the ends.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"

namespace number_options_test {

using support::run_command;

struct NumberOption {
  std::string name;  // "--duration"
  int count;         // of numbers that belong together
};

/// From the help, which names the type of each option: FLOAT:0 to 20, [FLOAT,FLOAT,FLOAT]:-1 to 1.
std::vector<NumberOption> number_options(const std::string& command) {
  std::istringstream help(run_command(command + " --help").output);
  std::vector<NumberOption> found;
  for (std::string line; std::getline(help, line);) {
    std::istringstream words(line);
    std::string name;
    std::string type;
    if (!line.starts_with(" ") || !(words >> name >> type)) continue;
    const std::size_t at = name.find("--");
    type = type.substr(type.starts_with("[") ? 1 : 0);
    const bool is_number = type.starts_with("FLOAT") || type.starts_with("INT") || type.starts_with("UINT");
    if (at == std::string::npos || !is_number) continue;
    type = type.substr(0, type.find_first_of(":]"));
    found.push_back({name.substr(at), 1 + static_cast<int>(std::ranges::count(type, ','))});
  }
  return found;
}

/// The commands of a program, from its help; none where it has none.
std::vector<std::string> subcommands(const std::string& program) {
  std::istringstream help(run_command(program + " --help").output);
  std::vector<std::string> found;
  bool listed = false;
  for (std::string line; std::getline(help, line);) {
    if (line.starts_with("Subcommands:")) listed = true;
    if (listed && line.starts_with("  ") && line.find_first_not_of(' ') == 2)
      found.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return found;
}

class NumberOptions : public testing::TestWithParam<std::string> {};

TEST_P(NumberOptions, AreFiniteAndWithinBounds) {
  const std::string& program = GetParam();
  std::vector<std::string> commands{program};
  for (const std::string& name : subcommands(program)) commands.push_back(program + " " + name);
  for (const std::string& command : commands)
    for (const NumberOption& option : number_options(command))
      for (const std::string wrong : {"nan", "inf", "-inf", "1e300"}) {
        std::string given = " " + option.name + "=" + wrong;
        for (int i = 1; i < option.count; ++i) given += " 0";
        const support::CommandResult result = run_command(command + given);
        EXPECT_EQ(result.exit_code, 2) << command << given << "\n" << result.output;
        EXPECT_TRUE(result.said(option.name) && result.said(wrong)) << command << given << "\n"
                                                                    << result.output;
      }
}

INSTANTIATE_TEST_SUITE_P(Programs, NumberOptions,
                         testing::Values(support::program("youbot-bench"), support::program("youbot-gap"),
                                         support::program("youbot-sim"), support::program("youbotd"),
                                         support::program("youbotctl")),
                         [](const testing::TestParamInfo<std::string>& program) {
                           std::string name = std::filesystem::path(program.param).filename();
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(NumberOptionsOfTheBench, AreSeenByTheTestAndShowTheirDefaults) {
  const std::string bench = support::program("youbot-bench");
  EXPECT_GE(subcommands(bench).size(), 19U);
  std::set<std::string> names;
  for (const NumberOption& option : number_options(bench + " steady-state")) names.insert(option.name);
  for (const char* name : {"--settle", "--max-speed", "--noise-seed", "--hidden-effect"})
    EXPECT_TRUE(names.contains(name)) << name;
  EXPECT_EQ(number_options(bench + " haptic-hold").size(), 4U);
  EXPECT_EQ(number_options(bench + " transparency").size(), 7U);
  EXPECT_EQ(number_options(bench + " curve").size(), 4U);
  EXPECT_TRUE(run_command(bench + " haptic-hold --help").said("=200\n"));
  EXPECT_TRUE(run_command(bench + " diagnose --help").said("=10\n"));
  EXPECT_TRUE(run_command(bench + " transparency --help").said("position-error,none"));
  const support::CommandResult identify = run_command(bench + " identify --help");
  EXPECT_TRUE(identify.said("=auto") && identify.said("elasto_plastic")) << identify.output;
  EXPECT_FALSE(run_command(bench + " improve --help").said("->"));
}

TEST(UnknownCommand, IsNamedWithThoseThereAre) {
  for (const std::string& program : {support::program("youbot-bench"), support::program("youbotctl")}) {
    const support::CommandResult result = run_command(program + " nosuch --out x");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(result.said("'nosuch'")) << result.output;
    for (const std::string& name : subcommands(program)) EXPECT_TRUE(result.said(name)) << result.output;
  }
  EXPECT_FALSE(run_command(support::program("youbot-bench") + " --quiet").said("no command '--quiet'"));
  const support::CommandResult none = run_command(support::program("youbot-bench"));
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_TRUE(none.said("subcommand is required")) << none.output;
}

TEST(CurveCommand, RemarksOnWhatWasNotMeasuredUnlessItIsToBeQuiet) {
  const std::string command =
      support::program("youbot-bench") + " curve --wheel 1 --from 0 --to 20 --step 10";
  const support::CommandResult refused = run_command(command);
  EXPECT_TRUE(refused.said("nothing was measured beyond")) << refused.output;
  const support::CommandResult quiet = run_command(command + " --quiet");
  EXPECT_EQ(quiet.exit_code, 0);
  EXPECT_TRUE(quiet.output.starts_with("velocity_rad_per_s,torque_Nm\n0,")) << quiet.output;
  EXPECT_FALSE(quiet.said("nothing was measured")) << quiet.output;
}

}  // namespace number_options_test
