/// @file
/// Confirmation by the person next to the robot before anything real moves.
#pragma once
#include <string>

namespace youbot_bench {

struct Confirmation {
  std::string robot;      ///< "ethercat:eth0"
  std::string what;       ///< "the joints will turn"
  std::string question;   ///< "Are the wheels off the ground?"
  std::string answer;     ///< "off the ground": no other answer is accepted
  std::string otherwise;  ///< without a terminal: "Lift the wheels off the ground and add --yes"
};

/// Asks on the terminal. @throws std::invalid_argument if there is none, or after another answer.
void confirm(const Confirmation& confirmation);

}  // namespace youbot_bench
