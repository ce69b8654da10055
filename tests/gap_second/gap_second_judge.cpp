// Draws cases, runs youbot-gap on them, and prints a line for each and two tables.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/gap_second/answer.h"
#include "tests/gap_second/cases.h"
#include "tests/gap_second/score.h"

namespace {

namespace fs = std::filesystem;

struct Options {
  std::uint64_t seed = 1;
  int count = 10;
  int first = 0;
  std::string classes = gap_second::kClasses;
  int jobs = 1;
  int longest_s = 180;
  bool no_edit_test = false;
  std::string keep;
  std::string program = fs::read_symlink("/proc/self/exe").parent_path() / "youbot-gap";
};

class Campaign {
 public:
  explicit Campaign(Options options) : options_(std::move(options)) {
    for (char case_class : options_.classes)
      for (int i = 0; i < options_.count; ++i) wanted_.emplace_back(case_class, options_.first + i);
    directory_ = options_.keep.empty()
                     ? fs::temp_directory_path() / ("gap-second-" + std::to_string(std::random_device{}()))
                     : fs::path(options_.keep);
    fs::create_directories(directory_);
  }

  /// Returns how many cases the rig itself could not judge.
  int run() {
    std::vector<std::thread> workers;
    for (int i = 0; i < options_.jobs; ++i) workers.emplace_back([this] { work(); });
    for (std::thread& worker : workers) worker.join();
    print_tables();
    if (options_.keep.empty()) fs::remove_all(directory_);
    return not_judged_;
  }

 private:
  void work() {
    for (std::size_t i = next_++; i < wanted_.size(); i = next_++) {
      try {
        do_case(wanted_[i].first, wanted_[i].second);
      } catch (const std::exception& error) {
        const std::lock_guard lock(printing_);
        ++not_judged_;
        std::printf("%c-%d NOT JUDGED: %s\n", wanted_[i].first, wanted_[i].second, error.what());
      }
    }
  }

  void do_case(char case_class, int number) {
    const gap_second::Case drawn = gap_second::draw_case(case_class, number, options_.seed);
    const fs::path directory = directory_ / drawn.id;
    fs::remove_all(directory);
    fs::create_directories(directory);
    const gap_second::CaseFiles files = gap_second::write_case(drawn, directory);
    const gap_second::Answer answer = gap_second::ask(options_.program, files, directory, options_.longest_s);
    gap_second::Score score = gap_second::judge(drawn, answer);
    if (!options_.no_edit_test)
      score.edits = gap_second::edit_tests(options_.program, drawn, answer, directory, options_.longest_s);
    if (options_.keep.empty()) fs::remove_all(directory);
    const std::lock_guard lock(printing_);
    std::printf("%s\n", gap_second::report_line(drawn, answer, score).c_str());
    std::fflush(stdout);
    by_class_[std::string(1, case_class)].add(answer, score);
    by_kind_[std::string(1, case_class) + " " + drawn.kind].add(answer, score);
  }

  void print_tables() const {
    for (const auto* tallies : {&by_kind_, &by_class_}) {
      constexpr std::size_t kNameWidth = 42;
      std::printf("\n%s", gap_second::table_head(kNameWidth).c_str());
      for (const auto& [row_name, tally] : *tallies)
        std::printf("%s", gap_second::table_row(row_name, tally, kNameWidth).c_str());
    }
  }

  Options options_;
  std::vector<std::pair<char, int>> wanted_;
  fs::path directory_;
  std::atomic<std::size_t> next_ = 0;
  std::mutex printing_;
  int not_judged_ = 0;
  std::map<std::string, gap_second::Tally> by_class_;
  std::map<std::string, gap_second::Tally> by_kind_;
};

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Judges youbot-gap on drives of a second, independent simulation.");
  app.add_option("--seed", options.seed, "of all that is drawn: the same seed draws the same cases")
      ->capture_default_str();
  app.add_option("--count", options.count, "cases of each class")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--first", options.first, "number of the first case; case 17 is the same whatever the count")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  app.add_option("--class", options.classes,
                 "a clean, b one effect missing, c two, d bad data, e poor base model, f unknown cause")
      ->capture_default_str()
      ->check([](const std::string& classes) {
        return classes.find_first_not_of(gap_second::kClasses) == std::string::npos ? ""
                                                                                    : "classes are a to f";
      });
  app.add_option("--jobs", options.jobs, "cases at the same time")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--longest", options.longest_s, "seconds that youbot-gap may take")->capture_default_str();
  app.add_flag("--no-edit-test", options.no_edit_test, "leave it out: less than half the time");
  app.add_option("--keep", options.keep, "directory for recordings and answers, which are deleted otherwise");
  app.add_option("--program", options.program, "the youbot-gap to judge")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return Campaign(options).run() == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gap_second_judge: error: %s\n", error.what());
    return 2;
  }
}
