#include "runtime/program/bash_completion.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>

#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace runtime {
namespace bash_completion_test {

/// A program with a command, and bash, which completes its command lines.
class BashCompletion : public testing::Test {
 protected:
  BashCompletion() {
    app_.add_option("--robot", text_, "what stands on the bus")
        ->check(CLI::IsMember({"arm", "base", "base+arm"}));
    app_.add_option("--model", text_, "a file");
    app_.add_flag("--quiet", flag_, "print problems only");
    app_.add_subcommand("scan", "list the slaves")->add_flag("--json", flag_, "for machines");
    app_.add_subcommand("sdo", "read an object");
  }

  /// What is offered for the last of the words behind the program's name.
  std::string offered(const std::string& words) const {
    const auto script = directory_.write("completion", bash_completion(app_));
    return support::run_command(
               "bash -c 'set -u; source \"" + script.string() + "\"; COMP_WORDS=(wheel-tool " + words +
               "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _wheel_tool; echo ${COMPREPLY[*]-}'")
        .output;
  }

  std::string text_;
  bool flag_ = false;
  CLI::App app_{"Drives the base.", "wheel-tool"};
  support::TemporaryDirectory directory_;
};

TEST_F(BashCompletion, OffersTheCommandsAndTheOptionsBeforeOne) {
  EXPECT_EQ(offered("\"\""), "scan sdo\n");
  EXPECT_EQ(offered("sc"), "scan\n");
  EXPECT_EQ(offered("--quiet s"), "scan sdo\n");
  EXPECT_EQ(offered("--"), "--help --robot --model --quiet\n");
}

TEST_F(BashCompletion, OffersTheOptionsOfTheCommand) {
  EXPECT_EQ(offered("--quiet scan --"), "--help --json\n");
  EXPECT_EQ(offered("sdo --"), "--help\n");
}

TEST_F(BashCompletion, OffersTheValuesOfAnOptionThatHasAListOfThem) {
  EXPECT_EQ(offered("--robot \"\""), "arm base base+arm\n");
  EXPECT_EQ(offered("--robot b"), "base base+arm\n");
}

TEST_F(BashCompletion, LeavesEverythingElseToTheNamesOfFiles) {
  EXPECT_EQ(offered("--model \"\""), "\n");
  EXPECT_EQ(offered("scan \"\""), "\n");
  const std::string script = bash_completion(app_);
  EXPECT_NE(script.find("complete -o default -F _wheel_tool wheel-tool\n"), script.npos);
}

}  // namespace bash_completion_test
}  // namespace runtime
