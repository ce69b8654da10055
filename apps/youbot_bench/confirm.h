/// @file
/// Nothing real moves without a word of the person beside it.
#pragma once
#include <string>

namespace youbot_bench {

struct Confirmation {
  std::string robot;      ///< "ethercat:eth0"
  std::string what;       ///< "the joints will turn"
  std::string question;   ///< "Are the wheels off the ground?"
  std::string answer;     ///< "off the ground": nothing else will do
  std::string otherwise;  ///< without a terminal: "Lift the wheels off the ground and add --yes"
};

/// Asks on the terminal. @throws std::invalid_argument when there is none, or another answer came.
void confirm(const Confirmation& confirmation);

}  // namespace youbot_bench
