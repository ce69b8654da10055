// tests/data/README.md: each of its examples prints the documented output, which agrees with published
// numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <vector>

#include "tests/documents/commands.h"
#include "tests/documents/published_numbers.h"
#include "tests/support/built_paths.h"

namespace data_examples_test {

namespace fs = std::filesystem;
using documents::Block;

const fs::path kData = support::source_dir() + "/tests/data";

std::vector<Block> examples() {
  std::vector<Block> blocks = documents::fenced_blocks(kData / "README.md");
  std::erase_if(blocks, [](const Block& block) { return block.language != "console"; });
  return blocks;
}

std::string test_name(const testing::TestParamInfo<Block>& example) {
  std::string name;
  for (const char c : example.param.heading)
    name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
}

class DataExample : public testing::TestWithParam<Block> {};

TEST_P(DataExample, PrintsWhatTheDocumentSays) {
  const documents::Checkout checkout;
  for (const documents::Step& step : documents::console_steps(GetParam())) {
    const support::CommandResult result = checkout.run(step.command);
    EXPECT_EQ(result.exit_code, 0) << step.command;
    EXPECT_EQ(documents::first_missing(step.printed, result.output), "") << step.command << "\nprinted:\n"
                                                                         << result.output;
  }
  const auto& judges = documents::published_numbers();
  if (const auto judge = judges.find(GetParam().heading); judge != judges.end()) judge->second(checkout);
}

TEST(PublishedNumbers, AreThoseOfExamples) {
  const std::vector<Block> all = examples();
  for (const auto& [heading, judge] : documents::published_numbers())
    EXPECT_EQ(std::ranges::count(all, heading, &Block::heading), 1) << heading;
}

INSTANTIATE_TEST_SUITE_P(OfEachDataSet, DataExample, testing::ValuesIn(examples()), test_name);

}  // namespace data_examples_test
