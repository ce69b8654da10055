#include "runtime/program/manual_page.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <string>

namespace runtime {
namespace manual_page_test {

class ManualPage : public testing::Test {
 protected:
  /// Whether the page has these lines, one below the other.
  bool has(const std::string& lines) const {
    return manual_page(app_).find("\n" + lines + "\n") != std::string::npos;
  }

  bool flag_ = false;
  CLI::App app_{"Drives the base. IT MOVES.", "wheel-tool"};
};

TEST_F(ManualPage, IsNamedAsTheProgramAndDescribedInOneLineForApropos) {
  EXPECT_TRUE(manual_page(app_).starts_with(".TH WHEEL\\-TOOL 1 "));
  EXPECT_TRUE(has(".SH NAME\nwheel\\-tool \\- drives the base"));
  EXPECT_TRUE(has(".SH DESCRIPTION\nDrives the base. IT MOVES."));
}

TEST_F(ManualPage, ListsEachOptionWithItsValueAsHelpDoes) {
  std::string joint = "wheel-1";
  app_.add_option("--joint", joint, "which one")->capture_default_str();
  app_.add_option("file", joint, "a recording")->required();
  app_.add_flag("-q,--quiet", flag_, "print problems only");
  EXPECT_TRUE(has(".SH SYNOPSIS\nwheel\\-tool [OPTIONS] file"));
  EXPECT_TRUE(has(".TP\n\\fB\\-\\-joint\\fR TEXT=wheel\\-1\nwhich one"));
  EXPECT_TRUE(has(".TP\n\\fBfile\\fR TEXT REQUIRED\na recording"));
  EXPECT_TRUE(has(".TP\n\\fB\\-q,\\-\\-quiet\\fR\nprint problems only"));
}

TEST_F(ManualPage, ListsTheOptionsOfEachCommandAndTheHelpOptionOnce) {
  app_.add_subcommand("turn", "turn a wheel")->add_flag("--back", flag_, "the other way");
  app_.require_subcommand(1);
  EXPECT_TRUE(has(".SH SYNOPSIS\nwheel\\-tool [OPTIONS] SUBCOMMAND"));
  EXPECT_TRUE(has(".SS wheel\\-tool turn [OPTIONS]\nturn a wheel\n.TP\n\\fB\\-\\-back\\fR\nthe other way"));
  const std::string page = manual_page(app_);
  EXPECT_EQ(page.find("\\-\\-help"), page.rfind("\\-\\-help"));
}

TEST_F(ManualPage, ShowsAFooterWhereItBelongs) {
  app_.footer("Exit codes: 0 done.");
  app_.add_subcommand("scan", "list the slaves");  // has the program's
  app_.add_subcommand("turn", "turn a wheel")->footer("One wheel only.");
  EXPECT_TRUE(has(".PP\nOne wheel only."));
  const std::string page = manual_page(app_);
  EXPECT_EQ(page.find("Exit codes"), page.rfind("Exit codes"));
  EXPECT_TRUE(page.ends_with(".SH NOTES\nExit codes: 0 done.\n"));
}

TEST_F(ManualPage, TakesNoTextForARequestOfRoff) {
  app_.footer(".so is a request\n'too, and C:\\temp a path\n.so again");
  EXPECT_TRUE(
      has(".SH NOTES\n\\&.so is a request\n.br\n\\&\\(aqtoo, and C:\\etemp a path\n.br\n\\&.so again"));
}

}  // namespace manual_page_test
}  // namespace runtime
