// Recording: from the cycle's ring to whole rows on disk, also when the disk is full.
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <future>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "hal/setup_error.h"
#include "runtime/recording/record_rows.h"
#include "runtime/recording/recorder.h"
#include "runtime/recording/recording_file.h"
#include "runtime/spsc_ring.h"
#include "tests/support/file_size_limit.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/temporary_directory.h"

namespace recording_test {

using runtime::Recorder;
using runtime::RecordingFile;
using runtime::SpscRing;
using support::FileSizeLimit;

/// Two words that must agree, so that a slot read while it is being written shows.
struct Numbered {
  std::uint64_t number = 0;
  std::uint64_t complement = ~std::uint64_t{0};
};
Numbered numbered(std::uint64_t number) { return {number, ~number}; }

/// Errors that a pop() loop, or a sink, found in the order of Numbered records starting at 0.
class OrderCheck {
 public:
  void see(const Numbered& record) {
    if (record.number != seen_ || record.complement != ~seen_) ++out_of_order_;
    ++seen_;
  }
  std::uint64_t seen() const { return seen_; }
  std::uint64_t out_of_order() const { return out_of_order_; }

 private:
  std::uint64_t seen_ = 0;
  std::uint64_t out_of_order_ = 0;
};

// ---------------------------------------------------------------------------------------------- ring

struct Wide {
  int columns;
};
template <typename Column>
void visit(const Wide& record, Column&& column) {
  for (int i = 0; i < record.columns; ++i) column("column", std::to_string(i).c_str(), 0.5 * i, 1);
}

TEST(RecordRows, MoreColumnsThanARowHoldsAreRefused) {
  EXPECT_EQ(runtime::columns_of(Wide{128}).back().name, "column127");
  EXPECT_THROW((void)runtime::columns_of(Wide{129}), std::length_error);
}

TEST(SpscRing, RoundsItsCapacityUpToAPowerOfTwo) {
  EXPECT_EQ(SpscRing<int>(1).capacity(), 1u);
  EXPECT_EQ(SpscRing<int>(5).capacity(), 8u);
  EXPECT_EQ(SpscRing<int>(64).capacity(), 64u);
}

TEST(SpscRing, RefusesACapacityThatCannotBe) {
  EXPECT_THROW(SpscRing<char>{0}, std::invalid_argument);
  EXPECT_THROW(SpscRing<char>{std::numeric_limits<std::size_t>::max()}, std::invalid_argument);
}

TEST(SpscRing, RefusesWhenFullAndGoesOnInOrderAfterAPop) {
  SpscRing<int> ring(4);
  int out = -1;
  EXPECT_FALSE(ring.pop(out));
  EXPECT_EQ(out, -1);

  // Many laps, so that every slot is met both as the first and as the last one.
  int pushed = 0;
  int popped = 0;
  for (int lap = 0; lap < 10; ++lap) {
    while (ring.push(pushed)) ++pushed;
    EXPECT_EQ(pushed - popped, 4);
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(ring.pop(out));
      EXPECT_EQ(out, popped++);
    }
  }
  while (ring.pop(out)) EXPECT_EQ(out, popped++);
  EXPECT_EQ(popped, pushed);
}

TEST(SpscRing, KeepsOrderAndLosesNothingBetweenTwoThreads) {
  constexpr std::uint64_t kItems = 1'000'000;
  SpscRing<Numbered> ring(256);  // small, so that both ends meet full and empty often
  std::thread producer([&ring] {
    for (std::uint64_t i = 0; i < kItems; ++i) {
      while (!ring.push(numbered(i))) std::this_thread::yield();
    }
  });
  OrderCheck order;
  for (Numbered record; order.seen() < kItems;) {
    if (ring.pop(record)) {
      order.see(record);
    } else {
      std::this_thread::yield();
    }
  }
  producer.join();
  EXPECT_EQ(order.out_of_order(), 0u);
  Numbered none;
  EXPECT_FALSE(ring.pop(none));
}

TEST(SpscRing, PushAndPopDoNotAllocateOrLock) {
  SpscRing<Numbered> ring(8);
  Numbered record;
  bool last_push = true;
  const support::NoAllocGuard guard;
  for (std::uint64_t i = 0; i < 9; ++i) last_push = ring.push(numbered(i));
  while (ring.pop(record)) {
  }
  EXPECT_EQ(guard.violations(), 0);
  EXPECT_FALSE(last_push);  // the full ring was part of it
}

// ---------------------------------------------------------------------------------------------- file

/// The format read back with an independent parser; throws on anything that is not a complete recording.
struct ReadBack {
  std::vector<std::pair<std::string, std::string>> comments;
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;
};

std::string text_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error("cannot read " + path.string());
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

double number_of(const std::string& field) {
  double value = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size()) {
    throw std::runtime_error("not a number: " + field);
  }
  return value;
}

ReadBack read_back(const std::filesystem::path& path) {
  const std::string text = text_of(path);
  if (!text.ends_with('\n')) throw std::runtime_error("torn last line: " + text);
  ReadBack recording;
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  if (line != "# youbot recording v1") throw std::runtime_error("first line: " + line);
  while (std::getline(lines, line) && line.starts_with("# ")) {
    const std::size_t colon = line.find(": ");
    if (colon == std::string::npos) throw std::runtime_error("comment: " + line);
    recording.comments.emplace_back(line.substr(2, colon - 2), line.substr(colon + 2));
  }
  recording.columns = fields_of(line);
  while (std::getline(lines, line)) {
    std::vector<double> row;
    for (const std::string& field : fields_of(line)) row.push_back(number_of(field));
    if (row.size() != recording.columns.size()) throw std::runtime_error("torn row: " + line);
    recording.rows.push_back(row);
  }
  return recording;
}

testing::AssertionResult contains(const std::string& text, std::string_view part) {
  if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
  return testing::AssertionFailure() << '"' << text << "\" does not contain \"" << part << '"';
}

/// The message of the `Error` that setting up a recording must end in.
template <typename Error>
std::string set_up_error(const std::filesystem::path& path,
                         const std::vector<RecordingFile::Comment>& comments,
                         const std::vector<RecordingFile::Column>& columns,
                         RecordingFile::Existing existing = RecordingFile::Existing::kRefuse) {
  try {
    const RecordingFile file(path, comments, columns, existing);
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "no error from " << path;
  return "";
}

const std::vector<RecordingFile::Comment> kComments{{"rig", "wheel-1"}};
const std::vector<RecordingFile::Column> kColumns{{"time_s", 6}, {"position_rad"}};

/// Row `i` of a recording with kColumns. All take the same number of bytes for i below 1000.
std::array<double, 2> row(int i) { return {0.001 * i, 0.5}; }
constexpr std::uintmax_t kRowBytes = std::string_view("0.001000,0.5\n").size();

class RecordingFileTest : public testing::Test {
 protected:
  std::filesystem::path path() const { return folder_ / "run.csv"; }
  std::uintmax_t bytes_on_disk() const { return std::filesystem::file_size(path()); }

  support::TemporaryDirectory folder_;
};
using RecordingFileOnFullDisk = RecordingFileTest;

TEST_F(RecordingFileTest, WritesTheFormatOfTheContract) {
  {
    RecordingFile file(path(), {{"rig", "wheel-1"}, {"experiment", "staircase: 3 steps"}},
                       {{"time_s", 6}, {"torque_command_Nm"}, {"torque_measured_Nm", 3}, {"position_rad"}});
    file.append_row(std::array{0.001, 0.1, 0.0456, -2.5});
    file.append_row(std::array{0.002, -std::nan(""), std::nan(""), 1e-300});
  }
  EXPECT_EQ(text_of(path()),
            "# youbot recording v1\n"
            "# rig: wheel-1\n"
            "# experiment: staircase: 3 steps\n"
            "time_s,torque_command_Nm,torque_measured_Nm,position_rad\n"
            "0.001000,0.1,0.046,-2.5\n"
            "0.002000,nan,nan,1e-300\n");
}

TEST_F(RecordingFileTest, ReadsBackTheSameBits) {
  using Limits = std::numeric_limits<double>;
  const std::vector<double> values{0.0,
                                   -0.0,
                                   0.1,
                                   1.0 / 3.0,
                                   -std::numbers::pi,
                                   123456789.125,
                                   Limits::max(),
                                   Limits::lowest(),
                                   Limits::min(),
                                   Limits::denorm_min(),
                                   Limits::epsilon(),
                                   Limits::infinity()};
  RecordingFile file(path(), kComments, {{"time_s", 6}, {"value"}});
  for (const double value : values) file.append_row(std::array{0.0, value});
  file.close();

  const ReadBack recording = read_back(path());
  EXPECT_EQ(recording.comments, (std::vector<std::pair<std::string, std::string>>{{"rig", "wheel-1"}}));
  EXPECT_EQ(recording.columns, (std::vector<std::string>{"time_s", "value"}));
  ASSERT_EQ(recording.rows.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(std::bit_cast<std::uint64_t>(recording.rows[i][1]), std::bit_cast<std::uint64_t>(values[i]))
        << values[i];
  }
  EXPECT_EQ(file.rows_written(), values.size());
  EXPECT_EQ(file.error(), "");
}

TEST_F(RecordingFileTest, TheLongestNumbersFillTheMemoryToItsEdgeAndAllArrive) {
  // 400 columns of fixed notation make a row longer than the usual memory, which must grow to hold it.
  const std::vector<RecordingFile::Column> columns = [] {
    std::vector<RecordingFile::Column> wide;
    for (int i = 0; i < 400; ++i) wide.push_back({"c" + std::to_string(i), RecordingFile::kMaxDecimals});
    return wide;
  }();
  const std::vector<double> longest(columns.size(), std::numeric_limits<double>::lowest());
  RecordingFile file(path(), {}, columns);
  for (int i = 0; i < 3; ++i) file.append_row(longest);
  file.close();
  EXPECT_EQ(read_back(path()).rows, std::vector(3, longest));
}

TEST_F(RecordingFileTest, FlushesByItselfWhenTheMemoryIsFull) {
  constexpr int kRows = 20'000;  // several times the memory
  RecordingFile file(path(), kComments, kColumns);
  for (int i = 0; i < kRows; ++i) file.append_row(row(i));
  EXPECT_GT(file.rows_written(), 0u);
  file.close();
  const ReadBack recording = read_back(path());
  ASSERT_EQ(recording.rows.size(), std::size_t{kRows});
  EXPECT_EQ(recording.rows.back().front(), 0.001 * (kRows - 1));
  EXPECT_EQ(file.error(), "");
}

TEST_F(RecordingFileTest, FormattingARowDoesNotAllocateOrLock) {
  RecordingFile file(path(), kComments, {{"time_s", 6}, {"a"}, {"b"}, {"c", 17}});
  const std::array values{1234.5, std::nan(""), std::numeric_limits<double>::denorm_min(), 1e300};
  const support::NoAllocGuard guard;
  for (int i = 0; i < 1000; ++i) file.append_row(values);  // enough for a flush in between
  EXPECT_EQ(guard.violations(), 0);
}

TEST_F(RecordingFileTest, MissingFolderThrowsNamingPathAndCause) {
  const auto nowhere = folder_ / "no_such_folder" / "run.csv";
  const std::string message = set_up_error<hal::SetupError>(nowhere, kComments, kColumns);
  EXPECT_TRUE(contains(message, nowhere.string()));
  EXPECT_TRUE(contains(message, "No such file or directory"));
}

TEST_F(RecordingFileTest, RefusesADeviceBecauseATornRowCouldNotBeCutOff) {
  const std::string message = set_up_error<hal::SetupError>("/dev/full", kComments, kColumns);
  EXPECT_TRUE(contains(message, "/dev/full: not a regular file"));
}

TEST_F(RecordingFileTest, APipeWithoutAReaderIsRefusedAndNotWaitedFor) {
  ASSERT_EQ(mkfifo(path().c_str(), 0600), 0);
  for (const auto existing : {RecordingFile::Existing::kRefuse, RecordingFile::Existing::kReplace}) {
    const std::string message = set_up_error<hal::SetupError>(path(), kComments, kColumns, existing);
    EXPECT_TRUE(contains(message, path().string() + ": not a regular file")) << message;
  }
  EXPECT_TRUE(std::filesystem::is_fifo(path()));
}

TEST_F(RecordingFileTest, RefusesAFileThatIsBeingRecordedAndLeavesItAlone) {
  RecordingFile file(path(), kComments, kColumns);
  file.append_row(row(0));
  file.flush();
  const std::string message =
      set_up_error<hal::SetupError>(path(), kComments, kColumns, RecordingFile::Existing::kReplace);
  EXPECT_TRUE(contains(message, path().string() + ": another recording is being written"));
  EXPECT_EQ(read_back(path()).rows.size(), 1u);
}

TEST_F(RecordingFileTest, ReplacesAnEarlierRecordingOnRequestOnly) {
  {
    RecordingFile earlier(path(), kComments, kColumns);
    for (int i = 0; i < 10; ++i) earlier.append_row(row(i));
  }
  const std::string message = set_up_error<hal::SetupError>(path(), kComments, kColumns);
  EXPECT_TRUE(contains(message, path().string() + ": cannot create the file: File exists")) << message;
  EXPECT_EQ(read_back(path()).rows.size(), 10u);
  { const RecordingFile file(path(), kComments, kColumns, RecordingFile::Existing::kReplace); }
  EXPECT_TRUE(read_back(path()).rows.empty());
}

/// Also where the next digit is a five or nearly one, the number is large, or it rounds to zero.
TEST_F(RecordingFileTest, FixedDecimalsAreThoseOfTheStandardLibrary) {
  std::vector<double> values{0.0,          -0.0,  0.5,
                             -0.5,         0.125, 2.5e-7,
                             4.9999999995, 1e11,  999999999999.5,
                             1e12,         1e300, std::numeric_limits<double>::infinity(),
                             1e-30,        0.045, 1.005,
                             -1.005};
  std::mt19937_64 random(1);
  std::uniform_real_distribution<> mantissa(-1, 1);
  std::uniform_int_distribution<> exponent(-12, 13);
  for (int i = 0; i < 20'000; ++i) values.push_back(mantissa(random) * std::pow(10.0, exponent(random)));
  for (int i = 0; i < 2'000; ++i) values.push_back((i + 0.5) * 1e-4);
  for (const int decimals : {0, 1, 3, 6, 9, 12, 13}) {
    RecordingFile file(path(), {}, {{"value", decimals}}, RecordingFile::Existing::kReplace);
    for (const double value : values) file.append_row(std::array{value});
    file.close();
    ASSERT_TRUE(file.error().empty()) << file.error();
    std::ifstream text(path());
    std::string line;
    while (line != "value" && std::getline(text, line)) {
    }
    for (const double value : values) {
      ASSERT_TRUE(std::getline(text, line));
      std::array<char, 400> expected{};
      const auto end = std::to_chars(expected.data(), expected.data() + expected.size(), value,
                                     std::chars_format::fixed, decimals);
      ASSERT_EQ(line, std::string_view(expected.data(), end.ptr)) << decimals << " decimals";
    }
  }
}

TEST_F(RecordingFileTest, RefusesNamesThatWouldBreakTheFormat) {
  const auto message = [this](const std::vector<RecordingFile::Comment>& comments,
                              const std::vector<RecordingFile::Column>& columns) {
    return set_up_error<std::invalid_argument>(path(), comments, columns);
  };
  EXPECT_TRUE(contains(message({{"ri:g", "x"}}, kColumns), "comment key \"ri:g\""));
  EXPECT_TRUE(contains(message({{"", "x"}}, kColumns), "comment key \"\""));
  EXPECT_TRUE(contains(message({{"rig", "two\nlines"}}, kColumns), "comment \"rig\""));
  EXPECT_TRUE(contains(message({}, {}), "at least one column"));
  EXPECT_TRUE(contains(message({}, {{"a,b"}}), "column \"a,b\""));
  EXPECT_TRUE(contains(message({}, {{""}}), "column \"\""));
  EXPECT_TRUE(contains(message({}, {{"a"}, {"b"}, {"a"}}), "column \"a\" is given twice"));
  EXPECT_TRUE(contains(message({}, {{"a", -1}}), "0 to 17 decimals"));
  EXPECT_TRUE(contains(message({}, {{"a", 18}}), "0 to 17 decimals"));
  EXPECT_FALSE(std::filesystem::exists(path()));
}

TEST_F(RecordingFileTest, ARowOfTheWrongWidthOrAfterCloseIsCountedAsLost) {
  RecordingFile file(path(), kComments, kColumns);
  file.append_row(std::array{1.0});
  file.append_row(row(1));
  file.close();
  file.append_row(row(2));
  file.flush();
  file.close();
  EXPECT_EQ(read_back(path()).rows.size(), 1u);
  EXPECT_EQ(file.rows_written(), 1u);
  EXPECT_EQ(file.rows_lost(), 2u);
  EXPECT_TRUE(contains(file.error(), "one value for each column"));
}

TEST_F(RecordingFileTest, ADeletedFileIsReportedAndItsRowsAreLost) {
  RecordingFile file(path(), kComments, kColumns);
  file.append_row(row(0));
  file.flush();
  std::filesystem::remove(path());
  file.append_row(row(1));
  file.flush();
  EXPECT_EQ(file.rows_written(), 0u);
  EXPECT_EQ(file.rows_lost(), 2u);
  EXPECT_TRUE(contains(file.error(), path().string() + ": the file was deleted"));
}

TEST_F(RecordingFileTest, AFileDeletedAfterTheLastRowIsReportedAtClose) {
  RecordingFile file(path(), kComments, kColumns);
  file.append_row(row(0));
  file.flush();
  std::filesystem::remove(path());
  file.close();
  EXPECT_EQ(file.rows_lost(), 1u);
  EXPECT_TRUE(contains(file.error(), "the file was deleted"));
}

TEST_F(RecordingFileTest, AFileCutShortByAnotherProgramIsReportedAndItsRowsAreLost) {
  RecordingFile file(path(), kComments, kColumns);
  file.append_row(row(0));
  file.flush();
  std::filesystem::resize_file(path(), 10);
  file.append_row(row(1));
  file.close();
  EXPECT_EQ(bytes_on_disk(), 10u);  // rows under half a header would look like data and be none
  EXPECT_EQ(file.rows_lost(), 2u);
  EXPECT_TRUE(contains(file.error(), "another program cut the file short"));
}

TEST_F(RecordingFileTest, ATornRowThatCouldNotBeCutOffIsCutByTheNextFlush) {
  RecordingFile file(path(), kComments, kColumns);
  file.append_row(row(0));
  file.flush();
  std::ofstream(path(), std::ios::app) << "0.001000,0.";  // as a failed ftruncate would leave it
  file.append_row(row(1));
  file.flush();
  EXPECT_EQ(read_back(path()).rows.size(), 2u);
  EXPECT_EQ(file.error(), "");
}

TEST_F(RecordingFileOnFullDisk, KeepsWholeRowsAndCountsTheLostWhereverTheDiskEnds) {
  { const RecordingFile empty(path(), kComments, kColumns); }
  const std::uintmax_t header_bytes = bytes_on_disk();
  constexpr int kRows = 4;
  for (std::uintmax_t room = 0; room < kRows * kRowBytes; ++room) {
    RecordingFile file(path(), kComments, kColumns, RecordingFile::Existing::kReplace);
    {
      const FileSizeLimit full_disk(header_bytes + room);
      for (int i = 0; i < kRows; ++i) file.append_row(row(i));
      file.flush();
    }
    const std::uint64_t rows_that_fit = room / kRowBytes;
    ASSERT_EQ(read_back(path()).rows.size(), rows_that_fit) << room << " bytes of room";
    ASSERT_EQ(bytes_on_disk(), header_bytes + rows_that_fit * kRowBytes);
    ASSERT_EQ(file.rows_written(), rows_that_fit);
    ASSERT_EQ(file.rows_lost(), kRows - rows_that_fit);
    ASSERT_TRUE(contains(file.error(), path().string() + ": cannot write rows: File too large"));
  }
}

TEST_F(RecordingFileOnFullDisk, ResumesWithWholeRowsWhenSpaceComesBack) {
  RecordingFile file(path(), kComments, kColumns);
  file.append_row(row(0));
  file.flush();
  {
    const FileSizeLimit full_disk(bytes_on_disk() + kRowBytes + 5);
    for (int i = 1; i <= 3; ++i) file.append_row(row(i));
    file.flush();  // row 1 fits, rows 2 and 3 do not
    file.append_row(std::array{0.004, 0.125});
    file.flush();  // too long for the rest
  }
  file.append_row(row(5));
  file.close();

  const ReadBack recording = read_back(path());
  ASSERT_EQ(recording.rows.size(), 3u);
  EXPECT_EQ(recording.rows[0][0], 0.0);
  EXPECT_EQ(recording.rows[1][0], 0.001);
  EXPECT_EQ(recording.rows[2][0], 0.005);
  EXPECT_EQ(file.rows_written(), 3u);
  EXPECT_EQ(file.rows_lost(), 3u);
  EXPECT_TRUE(contains(file.error(), "3 rows lost, 3 written"));
}

TEST_F(RecordingFileOnFullDisk, RowsInMemoryDoNotPileUpWhileTheDiskIsFull) {
  constexpr int kRows = 20'000;  // several times the memory, so append_row() itself meets the full disk
  RecordingFile file(path(), kComments, kColumns);
  {
    const FileSizeLimit full_disk(bytes_on_disk());
    for (int i = 0; i < kRows; ++i) file.append_row(row(i));
    file.flush();
  }
  EXPECT_EQ(file.rows_lost(), std::uint64_t{kRows});
  EXPECT_TRUE(read_back(path()).rows.empty());
}

TEST_F(RecordingFileOnFullDisk, RoomForPartOfTheHeaderThrowsAndLeavesNothingBehind) {
  const std::string message = [this] {
    const FileSizeLimit full_disk(10);
    return set_up_error<hal::SetupError>(path(), kComments, kColumns);
  }();
  EXPECT_TRUE(contains(message, path().string() + ": cannot write the header: File too large"));
  EXPECT_FALSE(std::filesystem::exists(path()));
}

TEST_F(RecordingFileOnFullDisk, AFileSizeLimitDoesNotEndTheProcess) {
  RecordingFile file(path(), kComments, kColumns);
  {
    const FileSizeLimit full_disk(bytes_on_disk(), SIG_DFL);
    file.append_row(row(0));
    file.close();
  }
  EXPECT_EQ(file.rows_lost(), 1u);
  sigset_t blocked;
  pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
  EXPECT_EQ(sigismember(&blocked, SIGXFSZ), 0) << "the caller's signal mask must come back";
}

// ------------------------------------------------------------------------------------------ recorder

TEST(RecorderThread, StopDrainsEverythingInOrderAndFlushesLast) {
  constexpr std::uint64_t kRecords = 10'000;
  OrderCheck order;
  std::uint64_t seen_at_flush = 0;
  Recorder<Numbered> recorder(
      kRecords, [&](const Numbered& record) { order.see(record); }, [&] { seen_at_flush = order.seen(); });
  for (std::uint64_t i = 0; i < kRecords; ++i) EXPECT_TRUE(recorder.push(numbered(i)));
  recorder.stop();
  EXPECT_EQ(order.seen(), kRecords);
  EXPECT_EQ(order.out_of_order(), 0u);
  EXPECT_EQ(seen_at_flush, kRecords);
  EXPECT_EQ(recorder.statistics().pushed, kRecords);
  EXPECT_EQ(recorder.statistics().dropped, 0u);
}

TEST(RecorderThread, DestructorDrainsToo) {
  OrderCheck order;
  {
    Recorder<Numbered> recorder(
        64, [&](const Numbered& record) { order.see(record); }, [] {});
    for (std::uint64_t i = 0; i < 64; ++i) recorder.push(numbered(i));
  }
  EXPECT_EQ(order.seen(), 64u);
}

TEST(RecorderThread, EveryRecordIsEitherWrittenOrCountedAsDropped) {
  constexpr std::uint64_t kRecords = 200'000;
  std::uint64_t written = 0;
  std::uint64_t last_number = 0;
  bool in_order = true;
  Recorder<Numbered> recorder(
      16,
      [&](const Numbered& record) {
        in_order = in_order && (written == 0 || record.number > last_number);
        last_number = record.number;
        ++written;
      },
      [] {});
  std::thread cycle([&recorder] {
    for (std::uint64_t i = 0; i < kRecords; ++i) recorder.push(numbered(i));
  });
  cycle.join();
  recorder.stop();
  const auto statistics = recorder.statistics();
  EXPECT_TRUE(in_order);
  EXPECT_EQ(statistics.pushed, written);
  EXPECT_EQ(statistics.pushed + statistics.dropped, kRecords);
}

TEST(RecorderThread, AStalledSinkDropsAndCountsWithoutHoldingUpTheCycle) {
  std::promise<void> sink_entered;
  std::promise<void> disk_answers;
  OrderCheck order;
  Recorder<Numbered> recorder(
      4,
      [&](const Numbered& record) {
        if (order.seen() == 0) {
          sink_entered.set_value();
          disk_answers.get_future().wait();
        }
        order.see(record);
      },
      [] {});
  EXPECT_TRUE(recorder.push(numbered(0)));
  sink_entered.get_future().wait();  // the record is out of the ring, and the writer is held
  for (std::uint64_t i = 1; i <= 4; ++i) EXPECT_TRUE(recorder.push(numbered(i)));
  for (std::uint64_t i = 5; i <= 7; ++i) EXPECT_FALSE(recorder.push(numbered(i)));
  disk_answers.set_value();
  recorder.stop();
  EXPECT_EQ(recorder.statistics().pushed, 5u);
  EXPECT_EQ(recorder.statistics().dropped, 3u);
  EXPECT_EQ(order.seen(), 5u);
  EXPECT_EQ(order.out_of_order(), 0u);
}

TEST(RecorderThread, FlushesWhileItRuns) {
  std::promise<void> flushed_after_record;
  bool written = false;
  bool signalled = false;
  Recorder<Numbered> recorder(
      4, [&](const Numbered&) { written = true; },
      [&] {
        if (written && !std::exchange(signalled, true)) flushed_after_record.set_value();
      });
  recorder.push(numbered(0));
  flushed_after_record.get_future().wait();  // before stop(), or it would wait for ever
  recorder.stop();
}

TEST(RecorderThread, PushDoesNotAllocateOrLock) {
  Recorder<Numbered> recorder(
      16, [](const Numbered&) {}, [] {});
  const support::NoAllocGuard guard;
  for (std::uint64_t i = 0; i < 1000; ++i) recorder.push(numbered(i));  // fills the ring on the way
  EXPECT_EQ(guard.violations(), 0);
}

TEST(RecorderThread, AThrowingSinkIsCountedAndItsFirstMessageKept) {
  std::uint64_t calls = 0;
  Recorder<Numbered> recorder(
      8,
      [&](const Numbered& record) {
        ++calls;
        if (record.number == 1) throw std::runtime_error("number one");
        if (record.number == 2) throw 2;  // NOLINT: any type may come out of a sink
      },
      [&] {
        if (calls == 4) throw std::runtime_error("flush");
      });
  for (std::uint64_t i = 0; i < 4; ++i) recorder.push(numbered(i));
  recorder.stop();
  EXPECT_EQ(calls, 4u);  // it went on after each
  EXPECT_GE(recorder.statistics().sink_failures, 3u);
  EXPECT_EQ(recorder.first_sink_failure(), "number one");
}

TEST(RecorderThread, AnExceptionThatIsNoStdExceptionIsNamedAsSuch) {
  Recorder<Numbered> recorder(
      8, [](const Numbered&) { throw 2; }, [] {});
  recorder.push(numbered(0));
  recorder.stop();
  EXPECT_EQ(recorder.statistics().sink_failures, 1u);
  EXPECT_EQ(recorder.first_sink_failure(), "an exception that is not a std::exception");
}

TEST(RecorderThread, APushAfterStopIsCountedAsDropped) {
  Recorder<Numbered> recorder(
      8, [](const Numbered&) {}, [] {});
  recorder.stop();
  recorder.stop();
  EXPECT_FALSE(recorder.push(numbered(0)));
  EXPECT_EQ(recorder.statistics().dropped, 1u);
}

TEST(RecorderThread, RefusesAnEmptySink) {
  EXPECT_THROW(Recorder<Numbered>(8, nullptr, [] {}), std::invalid_argument);
  EXPECT_THROW(Recorder<Numbered>(
                   8, [](const Numbered&) {}, nullptr),
               std::invalid_argument);
}

TEST(RecorderThread, WriterHasNormalPriorityWhateverItsCreatorHas) {
  int writer_policy = -1;
  // SCHED_BATCH is inherited as SCHED_FIFO is, and needs no privilege.
  std::thread creator([&writer_policy] {
    const sched_param batch{};
    ASSERT_EQ(pthread_setschedparam(pthread_self(), SCHED_BATCH, &batch), 0);
    Recorder<Numbered> recorder(
        8, [&](const Numbered&) { writer_policy = sched_getscheduler(0); }, [] {});
    recorder.push(numbered(0));
  });
  creator.join();
  EXPECT_EQ(writer_policy, SCHED_OTHER);
}

TEST_F(RecordingFileTest, ARecorderBringsEveryRecordToTheFile) {
  RecordingFile file(path(), kComments, kColumns);
  Recorder<Numbered> recorder(
      4096, [&](const Numbered& record) { file.append_row(row(static_cast<int>(record.number))); },
      [&] { file.flush(); });
  std::uint64_t most_seen_on_disk = 0;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    recorder.push(numbered(i));
    most_seen_on_disk = std::max(most_seen_on_disk, file.rows_written());  // status, while it is written
  }
  recorder.stop();
  file.close();
  EXPECT_LE(most_seen_on_disk, 3000u);
  EXPECT_EQ(file.error(), "");
  const ReadBack recording = read_back(path());
  ASSERT_EQ(recording.rows.size(), 3000u);
  EXPECT_EQ(recording.rows.back()[0], row(2999)[0]);
}

}  // namespace recording_test
