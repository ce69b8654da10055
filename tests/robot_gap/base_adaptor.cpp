#include <stdexcept>

#include "tests/robot_gap/base_cases.h"

namespace robot_gap_test {

identification::robot_gap::RobotResult analyse_base(const BaseDesign& published,
                                                    const std::vector<BaseRecording>& /*data*/,
                                                    const std::vector<BaseRecording>& /*held_out*/,
                                                    std::uint64_t /*seed*/) {
  throw std::logic_error("the library does not search bases yet: " + published.name);
}

}  // namespace robot_gap_test
