/// @file
/// Runs the search for missing effects over the hidden data and holds it against its targets.
///
///     gap_proof --threads 2
///     gap_proof --only cogging --verbose
///
/// Beside it, two fits of all effects at once to the same data.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdio>
#include <map>
#include <mutex>
#include <numeric>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "model/effects/any_effect.h"
#include "tests/bench/figures.h"
#include "tests/gap/baselines.h"
#include "tests/gap/gap_cases.h"
#include "tests/gap/gap_judge.h"

namespace gap_test {
namespace {

constexpr double kStrong = 3;  // noise floors
constexpr std::string_view kNoName = "-";

struct Arguments {
  std::size_t cases = 0;
  std::string only;
  bool verbose = false;
  bool no_edit_test = false;
  unsigned threads = 1;
};

std::vector<CaseSpec> chosen_cases(const Arguments& arguments) {
  std::vector<CaseSpec> cases = gap_cases();
  std::erase_if(cases, [&](const CaseSpec& spec) {
    return !arguments.only.empty() && name_of(spec.kind) != arguments.only &&
           std::none_of(spec.hidden.begin(), spec.hidden.end(),
                        [&](Hidden hidden) { return name_of(hidden) == arguments.only; });
  });
  if (arguments.cases == 0 || arguments.cases >= cases.size()) return cases;
  std::vector<CaseSpec> spread;  // over all kinds
  for (std::size_t i = 0; i < arguments.cases; ++i)
    spread.push_back(cases[i * cases.size() / arguments.cases]);
  return spread;
}

std::string joined(const std::vector<std::string>& names) {
  return names.empty()
             ? std::string(kNoName)
             : std::accumulate(names.begin() + 1, names.end(), names.front(),
                               [](std::string sum, const std::string& name) { return sum + "+" + name; });
}

void print_case(const Judgement& judgement) {
  std::printf("%5llu %-7s %-38s %5.1f  %-18s %-38s gap %.5f -> %.5f floor %.5f (sensor %.5f) %5.1f s%s\n",
              static_cast<unsigned long long>(judgement.spec.seed),
              std::string(name_of(judgement.spec.kind)).c_str(), judgement.spec.name().c_str(),
              judgement.least_size, std::string(identification::gap::verdict_name(judgement.verdict)).c_str(),
              joined(judgement.named).c_str(), judgement.gap_before_Nm, judgement.gap_after_Nm,
              judgement.floor_Nm, judgement.true_floor_Nm, judgement.search_s,
              judgement.right() ? "" : "  WRONG");
  for (const Edit& edit : judgement.edits)
    std::printf("      without %s: gap %.5f, floor %.5f, refitted %.5f%s\n", edit.effect.c_str(), edit.gap_Nm,
                edit.never_Nm, edit.refitted_Nm,
                edit.at_the_floor() ? ""
                : edit.passed()     ? ", within its intervals"
                                    : "  EDIT FAILED");
  for (const std::string& words : judgement.parameters_outside) std::printf("      %s\n", words.c_str());
  if (!judgement.failure.empty()) std::printf("      failed: %s\n", judgement.failure.c_str());
  std::fflush(stdout);
}

/// The search's answers, and those of the baselines to the same cases.
struct Answers {
  std::vector<Judgement> judgements;
  std::vector<BaselineAnswers> baselines;
};

Answers run(const std::vector<CaseSpec>& cases, const Arguments& arguments) {
  Answers answers{std::vector<Judgement>(cases.size()), std::vector<BaselineAnswers>(cases.size())};
  std::vector<Judgement>& judgements = answers.judgements;
  std::atomic<std::size_t> next{0};
  std::size_t done = 0;
  std::mutex printing;
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size(); i = next++) {
      const Case made = make_case(cases[i]);
      judgements[i] = judge(made, !arguments.no_edit_test);
      answers.baselines[i] = baseline_answers(made);
      const std::lock_guard lock(printing);
      ++done;
      if (arguments.verbose)
        print_case(judgements[i]);
      else if (done % 10 == 0 || done == cases.size())
        std::fprintf(stderr, "%zu of %zu cases\n", done, cases.size());
    }
  };
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < arguments.threads; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  return answers;
}

/// Of a column: a to z, then A to Z.
char letter(std::size_t column) {
  constexpr std::size_t kAlphabet = 26;
  return static_cast<char>(column < kAlphabet ? 'a' + column : 'A' + column - kAlphabet);
}

/// Rows: effects in the data. Columns: named effects, a dot for never.
void print_confusion(const std::vector<Judgement>& judgements) {
  std::vector<std::string> columns;
  for (const auto& description : model::effects::effect_descriptions())
    columns.emplace_back(description.name);
  columns.emplace_back(kNoName);
  std::vector<std::string> rows;  // in the order of the list
  std::map<std::string, std::map<std::string, int>> counts;
  for (const Judgement& judgement : judgements) {
    if (judgement.spec.kind == CaseKind::kPair || judgement.spec.kind == CaseKind::kTriple) continue;
    std::string row = judgement.spec.name();
    if (judgement.spec.kind == CaseKind::kSingle && judgement.least_size < kStrong) row += " (small)";
    if (judgement.spec.kind == CaseKind::kOutside) row += " (outside)";
    if (!counts.contains(row)) rows.push_back(row);
    for (const std::string& name : judgement.named) ++counts[row][name];
    if (judgement.named.empty()) ++counts[row][std::string(kNoName)];
  }
  std::printf("\nIn the data, against what was named; `-` is nothing:\n");
  for (std::size_t i = 0; i < columns.size(); ++i)
    std::printf("%c %s%s", letter(i), columns[i].c_str(), i % 6 == 5 ? "\n" : "  ");
  std::printf("\n%-32s", "");
  for (std::size_t i = 0; i < columns.size(); ++i) std::printf("%3c", letter(i));
  std::printf("\n");
  for (const std::string& row : rows) {
    std::printf("%-32s", row.c_str());
    for (const std::string& column : columns) {
      const int count = counts[row][column];
      count != 0 ? std::printf("%3d", count) : std::printf("  .");
    }
    std::printf("\n");
  }

  std::printf("\nSeveral effects:\n");
  for (const Judgement& judgement : judgements) {
    if (judgement.spec.kind != CaseKind::kPair && judgement.spec.kind != CaseKind::kTriple) continue;
    std::printf("%-48s %s", judgement.spec.name().c_str(), judgement.right() ? "right" : "");
    if (!judgement.missed.empty()) std::printf("missed %s ", joined(judgement.missed).c_str());
    if (!judgement.extra.empty()) std::printf("extra %s", joined(judgement.extra).c_str());
    std::printf("\n");
  }
}

struct Share {
  int part = 0;
  int whole = 0;
  void count(bool in) {
    ++whole;
    part += in ? 1 : 0;
  }
  double value() const { return whole > 0 ? static_cast<double>(part) / whole : 0; }
};

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// What naming one effect after the other, and abstaining, buys: beside two ways to fit all at once.
void print_baselines(const Answers& answers) {
  struct Row {
    const char* what;
    std::array<Share, 3> share{};
  };
  Row nothing{"nothing missing, and something named"};
  Row single{"one effect of three noise floors or more, named right and alone"};
  Row pairs{"two effects, both named right and nothing else"};
  Row outside{"outside the library, and named"};
  std::array<std::vector<double>, 3> gaps;
  std::array<double, 3> names{};
  double count = 0;
  for (std::size_t i = 0; i < answers.judgements.size(); ++i) {
    const Judgement& judgement = answers.judgements[i];
    const BaselineAnswers& baselines = answers.baselines[i];
    const CaseKind kind = judgement.spec.kind;
    if (kind != CaseKind::kOutside && !baselines.could_name_all) continue;
    const bool alarm = kind == CaseKind::kNone || kind == CaseKind::kOutside;
    const std::array<bool, 3> named{!judgement.named.empty(), !baselines.sparse.named.empty(),
                                    !baselines.all_parameters.named.empty()};
    const std::array<bool, 3> right{judgement.right(), is_right(baselines.sparse, judgement.spec),
                                    is_right(baselines.all_parameters, judgement.spec)};
    Row* const row = kind == CaseKind::kNone                                        ? &nothing
                     : kind == CaseKind::kOutside                                   ? &outside
                     : kind == CaseKind::kPair                                      ? &pairs
                     : kind == CaseKind::kSingle && judgement.least_size >= kStrong ? &single
                                                                                    : nullptr;
    for (std::size_t k = 0; row != nullptr && k < named.size(); ++k)
      row->share[k].count(alarm ? named[k] : right[k]);
    if (alarm) continue;
    const std::array<double, 3> gap{judgement.gap_after_Nm, baselines.sparse.gap_after_Nm,
                                    baselines.all_parameters.gap_after_Nm};
    for (std::size_t k = 0; k < gap.size(); ++k) gaps[k].push_back(gap[k] / judgement.floor_Nm);
    names[0] += static_cast<double>(judgement.named.size());
    names[1] += static_cast<double>(baselines.sparse.named.size());
    names[2] += static_cast<double>(baselines.all_parameters.named.size());
    ++count;
  }
  std::printf("\n%-66s %12s %12s %12s\n", "Beside two fits without a search, of the same rows and columns",
              "youbot-gap", "sparse", "all at once");
  for (const Row* const row : {&nothing, &single, &pairs, &outside}) {
    std::printf("%-66s", row->what);
    for (const Share& share : row->share) std::printf(" %5d of %3d", share.part, share.whole);
    std::printf("\n");
  }
  const auto print_values = [](const char* what, const std::array<double, 3>& values) {
    std::printf("%-66s", what);
    for (const double value : values) std::printf(" %12.2f", value);
    std::printf("\n");
  };
  if (count == 0) return;
  print_values("names a drive, where effects of the library are missing",
               {names[0] / count, names[1] / count, names[2] / count});
  print_values("gap left of held-out recordings there, noise floors, median",
               {median(gaps[0]), median(gaps[1]), median(gaps[2])});
  const char* const how = "gap_proof: youbot-gap, sparse regression, all parameters at once";
  for (const Row* const row : {&nothing, &single, &pairs, &outside}) {
    std::string figure;
    for (const Share& share : row->share)
      figure +=
          (figure.empty() ? "" : "; ") + std::to_string(share.part) + " of " + std::to_string(share.whole);
    bench::add_figure(std::string("side by side on hidden drives: ") + row->what, figure, how);
  }
}

bool reached(const char* what, const Share& share, bool at_least, double target) {
  bench::add_figure(std::string("youbot-gap on hidden drives: ") + what,
                    std::to_string(share.part) + " of " + std::to_string(share.whole),
                    std::string("gap_proof, ") + (at_least ? "at least " : "at most ") +
                        bench::number_text(100 * target) + " % wanted");
  const bool good = share.whole == 0 || (at_least ? share.value() >= target : share.value() <= target);
  std::printf("%-4s %-66s %3d of %3d = %5.1f %%, %s %.0f %%\n", good ? "ok" : "MISS", what, share.part,
              share.whole, 100 * share.value(), at_least ? "at least" : "at most", 100 * target);
  return good;
}

bool print_targets(const std::vector<Judgement>& judgements) {
  Share nothing, single, pairs, triples, outside, closed, edited, at_floor, inside, base_inside,
      base_inside_outside;
  Share small, overlooked, alarms;
  std::map<identification::gap::Verdict, int> verdicts;
  std::vector<double> floor_ratios;
  double seconds = 0;
  int failures = 0;
  for (const Judgement& judgement : judgements) {
    const bool named = !judgement.named.empty();
    switch (judgement.spec.kind) {
      case CaseKind::kNone:
        nothing.count(named);
        alarms.count(judgement.verdict != identification::gap::Verdict::kNoGap);
        break;
      case CaseKind::kSingle:
        (judgement.least_size >= kStrong ? single : small).count(judgement.right());
        break;
      case CaseKind::kPair: pairs.count(judgement.right()); break;
      case CaseKind::kTriple: triples.count(judgement.right()); break;
      case CaseKind::kOutside:
        outside.count(named);
        if (judgement.least_size >= kStrong)
          overlooked.count(judgement.verdict == identification::gap::Verdict::kNoGap);
        break;
    }
    if (judgement.verdict == identification::gap::Verdict::kExplained && !judgement.edits.empty())
      edited.count(std::ranges::all_of(judgement.edits, [](const Edit& edit) { return edit.passed(); }));
    if (!judgement.edits.empty())
      at_floor.count(
          std::ranges::all_of(judgement.edits, [](const Edit& edit) { return edit.at_the_floor(); }));
    if (judgement.verdict == identification::gap::Verdict::kExplained)
      closed.count(judgement.gap_after_Nm <= 1.2 * judgement.floor_Nm);
    inside.part += judgement.parameters_inside;
    inside.whole += judgement.parameters;
    Share& base = judgement.spec.kind == CaseKind::kOutside ? base_inside_outside : base_inside;
    base.part += judgement.base_parameters_inside;
    base.whole += judgement.base_parameters;
    ++verdicts[judgement.verdict];
    floor_ratios.push_back(judgement.floor_Nm / judgement.true_floor_Nm);
    seconds += judgement.search_s;
    failures += judgement.failure.empty() ? 0 : 1;
  }
  std::sort(floor_ratios.begin(), floor_ratios.end());

  std::printf("\nverdicts:");
  for (const auto& [verdict, count] : verdicts)
    std::printf("  %s %d", std::string(identification::gap::verdict_name(verdict)).c_str(), count);
  std::printf("\nnoise floor in the search's band, of that of the torque samples: %.2f, %.2f to %.2f\n",
              floor_ratios[floor_ratios.size() / 2], floor_ratios.front(), floor_ratios.back());
  std::printf("small single effects named right: %d of %d; all of three effects: %d of %d\n", small.part,
              small.whole, triples.part, triples.whole);
  std::printf(
      "no gap, though something outside the library is there: %d of %d; a gap, though nothing is: %d of %d\n",
      overlooked.part, overlooked.whole, alarms.part, alarms.whole);
  std::printf("edit test passed at the noise floor, with no look at intervals: %d of %d\n", at_floor.part,
              at_floor.whole);
  std::printf("search: %.2f s a case\n\n", seconds / static_cast<double>(judgements.size()));
  bench::add_figure("youbot-gap on hidden drives: one search",
                    bench::number_text(seconds / static_cast<double>(judgements.size())) + " s",
                    "gap_proof, mean of " + std::to_string(judgements.size()) + " of " +
                        std::to_string(gap_cases().size()) + " drives, a thread each");

  bool good = reached("nothing missing, and something named", nothing, false, 0.03);
  good = reached("one effect of three noise floors or more, named right", single, true, 0.95) && good;
  good = reached("two effects, both named right and nothing else", pairs, true, 0.85) && good;
  good = reached("outside the library, and named", outside, false, 0.05) && good;
  good = reached("explained, and the gap left is within 1.2 noise floors", closed, true, 1) && good;
  good = reached("explained, and the edit test is passed", edited, true, 0.97) && good;
  good = reached("parameters within their 95 % intervals", inside, true, 0.9) && good;
  good = reached("the given model's own parameters within their intervals", base_inside, true, 0.9) && good;
  good = reached("the same while something outside the library is missing", base_inside_outside, true, 0.9) &&
         good;
  if (failures > 0) std::printf("MISS %d cases on which the search failed\n", failures);
  return good && failures == 0;
}

int prove(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Proof of the search for missing effects on hidden data; exit code 1 when a target is missed.");
  app.add_option("--cases", arguments.cases, "so many of the cases, spread over the list");
  app.add_option("--only", arguments.only,
                 "none, single, pair, triple, outside or the name of a hidden effect");
  app.add_flag("--verbose", arguments.verbose, "a line for each case");
  app.add_flag("--no-edit-test", arguments.no_edit_test, "leave it out: half the time");
  app.add_option("--threads", arguments.threads, "cases at a time")->check(CLI::Range(1, 256));
  CLI11_PARSE(app, argc, argv);
  const std::vector<CaseSpec> cases = chosen_cases(arguments);
  if (cases.empty()) {
    std::fprintf(stderr, "gap_proof: no case of kind or effect %s\n", arguments.only.c_str());
    return 2;
  }
  const Answers answers = run(cases, arguments);
  print_confusion(answers.judgements);
  print_baselines(answers);
  return print_targets(answers.judgements) ? 0 : 1;
}

}  // namespace
}  // namespace gap_test

int main(int argc, char** argv) { return gap_test::prove(argc, argv); }
