/// @file
/// Results of each experiment, as text, tables and plots for a page.
#pragma once
#include <string>
#include <vector>

#include "apps/youbot_bench/experiment_data.h"
#include "report/report.h"

namespace youbot_bench {

struct ResultTable {
  std::string caption;
  std::vector<report::Column> columns;
  std::vector<report::Row> rows{};
};

struct Findings {
  std::string title{};                 ///< the result in one line
  std::vector<std::string> remarks{};  ///< paragraphs below it
  ResultTable table{};
  std::vector<report::Plot> plots{};
};

// Each takes the data of its own experiment, including an interrupted one. @throws std::invalid_argument if
// columns are missing.
Findings steady_state_findings(const MeasuredExperiment& measured);
Findings torque_ramp_findings(const MeasuredExperiment& measured);
Findings dahl_findings(const MeasuredExperiment& measured);
Findings presliding_findings(const MeasuredExperiment& measured);
Findings stick_slip_findings(const MeasuredExperiment& measured);
Findings compensation_findings(const MeasuredExperiment& measured);
Findings staircase_findings(const MeasuredExperiment& measured);
Findings reversals_findings(const MeasuredExperiment& measured);
Findings multisine_findings(const MeasuredExperiment& measured);

}  // namespace youbot_bench
