// Files from outside: non-files and endless files are rejected without waiting.
#include "runtime/configuration/regular_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

#include "tests/support/temporary_directory.h"

namespace regular_file_test {

using runtime::read_regular_file;
using runtime::read_whole;
using runtime::RegularFile;

std::string refusal(const std::filesystem::path& path, std::size_t limit_bytes = 1000) {
  try {
    (void)read_regular_file(path, limit_bytes);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(RegularFile, IsReadWholeUpToItsLimit) {
  const support::TemporaryDirectory directory;
  for (const std::size_t size : {0U, 1U, 999U, 1000U})
    EXPECT_EQ(read_regular_file(directory.write("file", std::string(size, 'x')), 1000).size(), size);
  const std::string large(3'000'000, 'y');
  EXPECT_EQ(read_regular_file(directory.write("large", large), large.size()), large);
  EXPECT_EQ(refusal(directory.write("file", std::string(1001, 'x'))),
            "has more than the 1000 bytes that are expected");
}

TEST(RegularFile, NothingElseIs) {
  const support::TemporaryDirectory directory;
  EXPECT_EQ(refusal(directory.path()), "is a directory, expected a file");
  EXPECT_EQ(refusal(directory / "none"), "cannot be opened: No such file or directory");
  ASSERT_EQ(mkfifo((directory / "pipe").c_str(), 0600), 0);
  for (const std::filesystem::path& path : {directory / "pipe", std::filesystem::path("/dev/zero")})
    EXPECT_EQ(refusal(path), "is a device or pipe, expected a file");
}

TEST(RegularFile, TextOfWindowsIsNamed) {
  const support::TemporaryDirectory directory;
  for (const char* mark : {"\xff\xfe", "\xfe\xff"})
    EXPECT_EQ(refusal(directory.write("table.csv", mark + std::string("t"))),
              "is UTF-16 text: save it as UTF-8");
}

TEST(RegularFile, IsJudgedAndReadAsItWasOpenedWhateverItsPathLeadsToLater) {
  const support::TemporaryDirectory directory;
  const auto path = directory.write("file", "mine");
  std::filesystem::permissions(path, std::filesystem::perms(0644));
  const RegularFile file(path);
  std::filesystem::rename(directory.write("other", "theirs"), path);
  std::filesystem::permissions(path, std::filesystem::perms(0666));
  EXPECT_EQ(file.owner(), ::geteuid());
  EXPECT_FALSE(file.group_or_others_may_write());
  EXPECT_EQ(read_whole(file, 10), "mine");
  EXPECT_TRUE(RegularFile(path).group_or_others_may_write());
}

}  // namespace regular_file_test
