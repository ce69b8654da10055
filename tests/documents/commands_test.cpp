// The basis of the document tests: they detect a document that is no longer correct.
#include "tests/documents/commands.h"

#include <gtest/gtest.h>

namespace commands_test {

using documents::first_missing;

TEST(Commands, AreFoundWithTheirHeadingAndWhatTheyPrint) {
  const support::TemporaryDirectory directory;
  const auto file = directory.write("a.md",
                                    "# Top\n```\nnot one\n```\n## Below\n```console\n$ one \\\n    --two\n"
                                    "says this\n$ three\n```\n");
  const auto blocks = documents::fenced_blocks(file);
  ASSERT_EQ(blocks.size(), 2U);
  EXPECT_EQ(blocks[0].language, "");
  EXPECT_EQ(blocks[1].language, "console");
  EXPECT_EQ(blocks[1].heading, "Below");
  const auto steps = documents::console_steps(blocks[1]);
  ASSERT_EQ(steps.size(), 2U);
  EXPECT_EQ(steps[0].command, "one \\\n    --two");
  EXPECT_EQ(steps[0].printed, std::vector<std::string>{"says this"});
  EXPECT_EQ(steps[1].command, "three");
  EXPECT_THROW(documents::fenced_blocks(directory.write("b.md", "```\nno end\n")), std::runtime_error);
}

TEST(Commands, PrintedLinesAreComparedWordForWordAndNumbersWithinAFewPercent) {
  const std::string output = "gap 0.102 -> 1e-3 N·m\n  + stribeck: 28 of 32\nnext: -4\n";
  EXPECT_EQ(first_missing({"gap 0.1 -> 0.00102 N·m", "next: -4"}, output), "");
  EXPECT_EQ(first_missing({"  + stribeck: …"}, output), "");
  EXPECT_EQ(first_missing({"gap 0.12 -> 0.001 N·m"}, output), "gap 0.12 -> 0.001 N·m");
  EXPECT_EQ(first_missing({"next: 4"}, output), "next: 4");
  EXPECT_EQ(first_missing({"  + stribeck:"}, output), "  + stribeck:") << "only a part of the line";
  EXPECT_EQ(first_missing({"  + cogging: …"}, output), "  + cogging: …");
  EXPECT_EQ(first_missing({"next: -4", "gap 0.102 -> 1e-3 N·m"}, output), "gap 0.102 -> 1e-3 N·m")
      << "the order counts";
}

}  // namespace commands_test
