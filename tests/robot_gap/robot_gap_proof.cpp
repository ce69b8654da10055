/// @file
/// Runs the search for what a robot's model lacks over arms and bases that hide an effect.
///
///     robot_gap_proof --seeds 3
///     robot_gap_proof --only payload --verbose
///     robot_gap_proof --only base_single
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <string>
#include <utility>

#include "tests/robot_gap/base_cases.h"
#include "tests/robot_gap/robot_cases.h"

namespace robot_gap_test {
namespace {

std::string words(const identification::robot_gap::NamedEffect& one) {
  return one.effect + "(" + one.part + ")";
}

std::string named_text(const identification::robot_gap::RobotResult& result) {
  std::string text;
  for (const auto& found : result.effects) {
    text += (text.empty() ? "" : " + ") + words(found.name);
    for (const auto& rival : found.equivalent) text += " or " + words(rival);
  }
  return text.empty() ? "-" : text;
}

void print(const std::string& name, std::uint64_t seed, const Judged& answer, bool verbose) {
  const auto& r = answer.result;
  const auto& gap = r.gaps.front().gap;
  std::printf("%2llu %-44s %-16s %s; %.4g -> %.4g floor %.4g, dense %.4g, %.1f s%s\n",
              static_cast<unsigned long long>(seed), name.c_str(),
              std::string(identification::gap::verdict_name(r.verdict)).c_str(), named_text(r).c_str(),
              gap.before, gap.after, gap.noise_floor, gap.dense, answer.seconds,
              answer.right          ? ""
              : answer.among_rivals ? "  AMONG RIVALS"
              : answer.wrong_name   ? "  WRONG"
                                    : "  NOT NAMED");
  if (verbose) {
    std::printf("      %s; lag %.4f s\n", r.reason.c_str(), r.delay_s);
    for (const auto& found : r.effects) {
      std::printf("      + %s: gain %.3f, %d/%d blocks, p %.3g, without %.4g;", words(found.name).c_str(),
                  found.held_out_gain, found.blocks_improved, found.blocks, found.p_value,
                  found.gap_before.front());
      for (const auto& one : found.parameters)
        std::printf(" %s %.4g (%.4g to %.4g)", one.name.c_str(), one.value, one.lower, one.upper);
      std::printf("\n");
      if (!found.deciding_experiment.empty())
        std::printf("        decide: %s\n", found.deciding_experiment.c_str());
    }
    for (const auto& one : r.rejected)
      std::printf("      - %s: %s\n", words(one.name).c_str(), one.reason.c_str());
    for (const auto& [channel, own, judged] : r.channels)
      std::printf("      %s: %.4g -> %.4g, floor %.4g, dense %.4g\n", channel.name.c_str(), own.before,
                  own.after, own.noise_floor, own.dense);
  }
  std::fflush(stdout);
}

struct Count {
  int cases = 0, right = 0, rivals = 0, wrong = 0;
};

/// Of the cases whose name contains `only`.
class Proof {
 public:
  Proof(std::string only, bool verbose) : only_(std::move(only)), verbose_(verbose) {}
  bool wants(const std::string& name) const { return name.find(only_) != std::string::npos; }
  void take(const std::string& kind, const std::string& name, std::uint64_t seed, const Judged& judged) {
    print(name, seed, judged, verbose_);
    Count& count = counts_[kind];
    ++count.cases;
    parameters_ += judged.parameters;
    inside_ += judged.parameters_inside;
    count.right += judged.right ? 1 : 0;
    count.rivals += !judged.right && judged.among_rivals ? 1 : 0;
    count.wrong += judged.wrong_name ? 1 : 0;
  }
  void print_counts() const {
    for (const auto& [kind, count] : counts_)
      std::printf("%-16s %3d of %3d right, %d more among rivals, %d with a wrong name\n", kind.c_str(),
                  count.right, count.cases, count.rivals, count.wrong);
    std::printf("parameters within their 95 %% intervals: %d of %d\n", inside_, parameters_);
  }

 private:
  std::string only_;
  bool verbose_;
  std::map<std::string, Count> counts_;
  int parameters_ = 0;
  int inside_ = 0;
};

int prove(int argc, char** argv) {
  CLI::App app("Hidden arms and bases: what the search names, and whether it is right.", "robot_gap_proof");
  std::uint64_t seeds = 1;
  std::string only;
  bool verbose = false;
  app.add_option("--seeds", seeds, "robots of each kind")->capture_default_str();
  app.add_option("--only", only, "cases whose name contains this");
  app.add_flag("--verbose", verbose, "parameters and reasons");
  CLI11_PARSE(app, argc, argv);
  Proof proof(only, verbose);
  constexpr const char* kKinds[] = {"nothing missing", "one effect", "two effects", "outside"};
  for (const RobotCase& one : robot_cases(seeds))
    if (proof.wants(one.name()))
      proof.take(kKinds[static_cast<int>(one.kind)], one.name(), one.seed, answer(one));
  for (const BaseCase& one : base_cases(seeds))
    if (proof.wants(one.name())) proof.take(group_name(one.group), one.name(), one.seed, judge_base(one));
  proof.print_counts();
  return 0;
}

}  // namespace
}  // namespace robot_gap_test

// NOLINTNEXTLINE(bugprone-exception-escape): an exception ends the program with its message.
int main(int argc, char** argv) { return robot_gap_test::prove(argc, argv); }
