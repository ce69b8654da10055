/// @file
/// Judges a robot in another process by youbot-sim's --record output.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "tests/support/recording.h"

namespace support {

/// Violations of the rules of RobotWatch (tests/support/robot_watch.h) in such a record; empty if there are
/// none. The record has no enables and disables: the robot may start to move `enables` times, and its last
/// `still_rows` command nothing. A drive that holds its position counts as held by itself for a wheel.
/// @throws std::runtime_error for a recording that is not such a record
std::vector<std::string> violations_of_record(const Recording& record, int enables,
                                              std::size_t still_rows = 1);

}  // namespace support
