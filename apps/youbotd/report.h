/// @file
/// The summary in words.
#pragma once
#include <string>

#include "apps/youbotd/session.h"

namespace youbotd {

/// Figures of a run, several lines, each ended. What went wrong is logged apart (main.cpp).
std::string report(const Summary& summary);

/// The same motion without and with friction compensation, side by side, and what it shows.
std::string compare(const Summary& without, const Summary& with);

}  // namespace youbotd
