/// @file
/// What came of the chain from measuring to driving, in words.
#pragma once
#include <string>

#include "apps/youbot_bench/improve.h"
#include "report/report.h"
#include "runtime/configuration/hidden_effect.h"

namespace youbot_bench {

/// How far the four wheels are from where the reference has them, rms over both runs: heading counts with
/// what it moves them.
double path_error_m(const Drive& drive);
/// The same from where they were in other runs at that time.
double apart_m(const Drive& drive, const Drive& other);
/// Whether a figure fell by more than a twentieth.
bool less(double after, double before);

/// Two tables, what the search named and how the base drove, and a sentence on what they show; of what was
/// done.
std::string improvement_text(const Improvement& improvement);
/// What was hidden, and whether the search named it. For the end.
std::string reveal_text(const Improvement& improvement, const runtime::HiddenEffect& hidden);
/// Both for people, with plots. `reveal`: empty where nobody knows what is hidden.
report::Page improvement_page(const Improvement& improvement, const std::string& reveal);

}  // namespace youbot_bench
