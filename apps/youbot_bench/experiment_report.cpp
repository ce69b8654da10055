#include "apps/youbot_bench/experiment_report.h"

#include <algorithm>
#include <array>
#include <exception>
#include <iterator>
#include <vector>

#include "apps/youbot_bench/experiment_data.h"
#include "apps/youbot_bench/experiment_findings.h"
#include "report/report.h"
#include "runtime/configuration/quantity.h"
#include "runtime/program/wording.h"

namespace youbot_bench {
namespace {

struct Kind {
  const char* experiment;
  const char* result;
  bool with_rows;  ///< hours at constant velocity are summarised in the map
  Findings (*findings)(const MeasuredExperiment&);
};
constexpr auto kKinds =
    std::to_array<Kind>({{"steady-state", "steady-state-map", false, steady_state_findings},
                         {"torque-ramp", "torque-ramp-result", true, torque_ramp_findings},
                         {"dahl", "dahl-result", true, dahl_findings},
                         {"presliding", "presliding-result", true, presliding_findings},
                         {"stick-slip", "stick-slip-result", true, stick_slip_findings},
                         {"compensation", "compensation-result", true, compensation_findings},
                         {"staircase", "", true, staircase_findings},
                         {"reversals", "", true, reversals_findings},
                         {"multisine", "multisine-result", true, multisine_findings}});

struct Section {
  MeasuredExperiment measured;
  Findings findings;
};

Section section_of(const std::filesystem::path& directory, const Kind& kind) {
  Section section{.measured = read_experiment(directory, kind.experiment, kind.result, kind.with_rows),
                  .findings = {}};
  try {
    section.findings = kind.findings(section.measured);
  } catch (const std::exception& error) {
    section.findings.title = std::string(kind.experiment) + ": the recording cannot be shown";
    section.measured.problems.emplace_back(error.what());
  }
  return section;
}

/// Empty if it went as planned.
std::string stopped_early(const ExperimentRun& run, const std::filesystem::path& directory) {
  std::string text;
  if (!run.fault.empty()) text = "Stopped by a fault at " + run.fault + ". ";
  if (run.finished < run.planned)
    text += "Not finished: " + std::to_string(run.finished) + " of " +
            runtime::count_text(run.planned, "measurement") +
            ", and what was recorded of the next. Go on with: "
            "youbot-bench " +
            run.experiment + " --resume " + directory.string();
  return text;
}

/// The settings of the experiment itself. Those without a description belong to a bus: the file has them.
void add_configuration(report::Page& page, const MeasuredExperiment& measured) {
  if (measured.settings.empty()) return;
  std::vector<report::Row> rows;
  for (const Setting& setting : measured.settings) {
    if (setting.help.empty()) continue;
    const runtime::Quantity quantity = runtime::quantity_of(setting.key);
    rows.push_back({quantity.name, setting.value.empty() ? std::string("–") : setting.value, quantity.unit,
                    setting.help});
  }
  rows.push_back({std::string("all settings"),
                  report::Link{"experiment.toml", measured.name + "/experiment.toml"}, "",
                  "also those of the robot's bus; runs the experiment again"});
  page.table({{"setting"}, {"value"}, {"unit"}, {"what it is"}}, rows, "Configuration of " + measured.name);
}

void add(report::Page& page, const Section& section) {
  for (const std::string& problem : section.measured.problems) page.text(problem);
  for (const std::string& remark : section.findings.remarks) page.text(remark);
  for (const std::string& reason : section.measured.not_measured)
    page.text("A dash in the table: " + reason + ".");
  const ResultTable& table = section.findings.table;
  if (!table.rows.empty()) page.table(table.columns, table.rows, table.caption);
  std::vector<report::Plot> plots;
  std::ranges::copy_if(section.findings.plots, std::back_inserter(plots),
                       [](const report::Plot& plot) { return !plot.series.empty(); });
  if (!plots.empty()) page.plots(plots);
  add_configuration(page, section.measured);
}

}  // namespace

void write_experiment_report(const std::filesystem::path& directory, const ExperimentRun& run) {
  std::vector<Section> sections;
  for (const Kind& kind : kKinds)
    if (holds_experiment(directory, kind.experiment)) sections.push_back(section_of(directory, kind));
  const bool alone = sections.size() == 1;
  report::Page page(alone ? sections.front().findings.title
                          : runtime::count_text(static_cast<long long>(sections.size()), "experiment") +
                                " on one robot");
  for (const Section& section : sections) {
    if (!alone) page.heading(section.findings.title);
    if (section.measured.name == run.experiment) page.text(stopped_early(run, directory));
    add(page, section);
  }
  page.write(directory / "report.html");
}

}  // namespace youbot_bench
