/// @file
/// The page of a run: what each kind of run shows is in base_page.h and teleop_page.h, what all show in
/// run_page.h.
#pragma once
#include "report/report.h"

namespace operation {

/// Gets the records on the thread that writes them; the page is made after the last one.
template <typename Record, typename Summary>
class RunReport {
 public:
  RunReport() = default;
  RunReport(const RunReport&) = delete;
  RunReport& operator=(const RunReport&) = delete;
  virtual ~RunReport() = default;

  virtual void add(const Record& record) = 0;
  virtual report::Page page(const Summary& summary) const = 0;
};

}  // namespace operation
