/// @file
/// A robot in another process, judged by what youbot-sim --record wrote of it.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "tests/support/recording.h"

namespace support {

/// What breaks the rules of RobotWatch (tests/support/robot_watch.h) in such a record; empty when nothing
/// does. No enables and disables are in it: the robot may start to move `enables` times, and its last
/// `still_rows` command nothing. A drive that holds its place counts as held by itself at a wheel.
/// @throws std::runtime_error for a recording that is no such record
std::vector<std::string> violations_of_record(const Recording& record, int enables,
                                              std::size_t still_rows = 1);

}  // namespace support
