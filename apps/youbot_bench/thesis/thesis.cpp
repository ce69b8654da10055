#include "apps/youbot_bench/thesis/thesis.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <system_error>

#include "apps/youbot_bench/thesis/chapters.h"
#include "apps/youbot_bench/thesis/page.h"
#include "runtime/configuration/whole_file.h"
#include "runtime/log.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/progress_line.h"
#include "runtime/program/stop_on_signals.h"
#include "runtime/recording/made_paths.h"
#include "runtime/recording/output_directory.h"

namespace youbot_bench {
namespace thesis {
namespace {

constexpr std::array<Chapter, 7> kChapters{{{"specifications", specifications, 1},
                                            {"theory", theory, 1},
                                            {"steady-state", steady_state, 3},
                                            {"presliding", presliding, 7},
                                            {"compensation", compensation, 2},
                                            {"mapping", haptic_mapping, 1},
                                            {"teleoperation", teleoperation, 5}}};

std::vector<std::string> chapter_names() {
  std::vector<std::string> names;
  for (const Chapter& chapter : kChapters) names.emplace_back(chapter.name);
  return names;
}

bool chosen(const ThesisOptions& options, const Chapter& chapter) {
  return options.chapters.empty() ||
         std::ranges::find(options.chapters, chapter.name) != options.chapters.end();
}

/// Model files are named in a list with commas between.
void require_usable(const std::filesystem::path& out) {
  if (std::filesystem::absolute(out).string().find(',') != std::string::npos)
    throw std::invalid_argument("--out: " + out.string() + ": the path must not have a comma");
}

void print_result(const ThesisOptions& options, const std::vector<Figure>& figures) {
  const Tally print = tally(figures, kThesis);
  const Tally criteria = tally(figures, kCriterion);
  std::printf("%zu figures and tables, %zu printed numbers beside ours; %zu of the %zu that must agree do\n",
              figures.size(), print.compared, print.agree, print.must_agree);
  std::printf("taken from the thesis: %zu, by construction: %zu, may differ: %zu\n", print.settings,
              print.by_construction, print.may_differ);
  std::printf("criteria of ours: %zu; %zu of the %zu that must agree do\n", criteria.compared, criteria.agree,
              criteria.must_agree);
  std::printf("report: %s\n", (options.out / "report.html").c_str());
}

void report_disagreement(const std::vector<Figure>& figures) {
  for (const Figure& figure : figures)
    for (const Comparison& comparison : figure.compared)
      if (comparison.printed->limited() && !comparison.agrees())
        spdlog::error("{} does not agree: {}: expected {}, ours {:g} {}", comparison.printed->key,
                      comparison.printed->what, expected_text(*comparison.printed), comparison.ours,
                      comparison.printed->unit);
}

/// It was missing or empty before the run: its contents are the run's.
void empty_directory(const std::filesystem::path& out) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(out, ignored))
    std::filesystem::remove_all(entry.path(), ignored);
}

}  // namespace

std::vector<Figure> make_figures(const ThesisOptions& options) {
  const std::vector<std::string> known = chapter_names();
  for (const std::string& name : options.chapters)
    if (std::ranges::find(known, name) == known.end())
      throw std::invalid_argument("--chapters: there is no '" + name + "'");
  require_usable(options.out);
  runtime::MadePaths directories(runtime::make_output_directory(options.out));
  runtime::require_empty(options.out);
  int stages = 0;
  for (const Chapter& chapter : kChapters) stages += chosen(options, chapter) ? chapter.stages : 0;
  runtime::ProgressLine progress("youbot-bench thesis", options.quiet);
  int begun = 0;
  const Workshop workshop(options.out, [&](const std::string& stage) {
    progress.show(stage, std::min(1.0, static_cast<double>(begun++) / stages));
  });
  std::vector<Figure> figures;
  try {
    for (const Chapter& chapter : kChapters) {
      if (!chosen(options, chapter)) continue;
      std::vector<Figure> made = chapter.make(workshop);
      std::ranges::move(made, std::back_inserter(figures));
    }
    Workshop::go_on();
  } catch (const Stopped&) {
    empty_directory(options.out);
    throw;
  }
  directories.keep();
  progress.show("done", 1);
  progress.finish();
  return figures;
}

int exit_code(std::span<const Figure> figures) {
  const std::size_t outside = tally(figures, kThesis).outside + tally(figures, kCriterion).outside;
  return outside == 0 ? runtime::kExitOk : runtime::kExitDisagreement;
}

int thesis(const ThesisOptions& options) {
  try {
    const std::vector<Figure> figures = make_figures(options);
    page_of(figures, !options.chapters.empty()).write(options.out / "report.html");
    runtime::write_whole_file(options.out / "thesis.json", json_of(figures).dump(2) + "\n");
    report_disagreement(figures);
    if (!options.quiet) print_result(options, figures);
    return exit_code(figures);
  } catch (const Stopped&) {
    spdlog::info("stopped on request, nothing to compare; what it wrote is removed");
    return runtime::kExitInterrupted;
  }
}

}  // namespace thesis

Subcommand add_thesis(CLI::App& app) {
  const auto options = std::make_shared<thesis::ThesisOptions>();
  CLI::App* const command = app.add_subcommand(
      "thesis", "make the figures and tables of the thesis again, in simulation, beside its printed numbers");
  command->footer(
      "Writes OUT/report.html, OUT/thesis.json with the compared numbers, and the recordings of the "
      "experiments, each in a directory named after its figure. Everything runs on the thesis' "
      "simulated robot in virtual time, in about half a minute. Ctrl-C removes what was written.\nExit "
      "codes: 0 done, 1 done, but a number is beyond its limit, 130 interrupted, 2 usage, 3 disk.");
  command->add_option("--out", options->out, "directory for the report and the recordings")->required();
  command
      ->add_option("--chapters", options->chapters,
                   "only these, with commas between: specifications, theory, steady-state, presliding, "
                   "compensation, mapping, teleoperation; none named: all")
      ->delimiter(',')
      ->check(CLI::IsMember(thesis::chapter_names()).description(""));
  command->add_flag("--quiet", options->quiet, "print problems only");
  return {command, [options] {
            runtime::stop_on_signals();
            return thesis::thesis(*options);
          }};
}

}  // namespace youbot_bench
