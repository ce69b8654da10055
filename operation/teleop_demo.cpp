#include "operation/teleop_demo.h"

namespace operation {

std::vector<sim::Task> demo_tasks() {
  using namespace std::chrono_literals;
  namespace tasks = sim::tasks;
  // The end effector starts at (0.35, 0, 0.35) m; forward the handle reaches 4 cm, sideways and up 8.
  return {
      {tasks::Wait{2s}},
      {tasks::Reach{{0.37, 0.05, 0.38}}},
      {tasks::Follow{{{0.37, 0.05, 0.40}, {0.37, -0.05, 0.40}, {0.37, -0.05, 0.32}, {0.37, 0.05, 0.32}}},
       40s},
      {tasks::Button{0, true}},
      {tasks::Wait{500ms}},
      {tasks::Button{0, false}},
      {tasks::DriveFar{{1.05, 0.0, 0.35}}, 60s},
      {tasks::Touch{.direction_W = Eigen::Vector3d::UnitX(), .felt_N = 0.6}, 40s},
      {tasks::LetGo{}},
      {tasks::Wait{3s}},
  };
}

}  // namespace operation
