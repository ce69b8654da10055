/// @file
/// Texts on the result of the chain from measurement to driving.
#pragma once
#include <string>

#include "apps/youbot_bench/improve.h"
#include "report/report.h"
#include "runtime/configuration/hidden_effect.h"

namespace youbot_bench {

/// Distance of the four wheels from their reference positions, rms over both runs: this includes heading.
double path_error_m(const Drive& drive);
/// The same relative to their positions in other runs at that time.
double apart_m(const Drive& drive, const Drive& other);
/// Whether a value fell by more than a twentieth.
bool less(double after, double before);

/// Two tables, the named effects and the driving results, and a concluding sentence; for the stages that were
/// done.
std::string improvement_text(const Improvement& improvement);
/// The hidden effect, and whether the search named it. For the end.
std::string reveal_text(const Improvement& improvement, const runtime::HiddenEffect& hidden);
/// Both with plots. `reveal`: empty if the hidden effect is unknown.
report::Page improvement_page(const Improvement& improvement, const std::string& reveal);

}  // namespace youbot_bench
