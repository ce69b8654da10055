// A robot, selected by name; one exchange per period.
#include <youbot/robot.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "python/bindings.h"

namespace youbot_python {
namespace {

using std::chrono::nanoseconds;

/// The drives are off, for the reason that exchange() reported.
class RobotFault : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct State {
  double time_s = 0;
  bool enabled = false;
  Eigen::VectorXd position_rad;
  Eigen::VectorXd velocity_rad_per_s;
  Eigen::VectorXd torque_Nm;
};

/// @throws std::invalid_argument unless lower <= seconds <= upper.
nanoseconds nanoseconds_of(const char* name, double seconds, double lower, double upper) {
  if (!(seconds >= lower && seconds <= upper))  // negated so that NaN fails the check
    throw std::invalid_argument(std::string(name) + " must be " + std::string(py::str(py::float_(lower))) +
                                " to " + std::string(py::str(py::float_(upper))));
  return nanoseconds(std::llround(seconds * 1e9));
}

using Targets = std::optional<Eigen::VectorXd>;

class Robot {
 public:
  Robot(const std::string& name, double period_s, bool on_ground, bool arm)
      : period_(nanoseconds_of("period_s", period_s, 0.5e-3, 0.01)) {
    if (youbot::is_simulated(name))
      clock_ = std::make_unique<youbot::VirtualClock>();
    else
      clock_ = std::make_unique<youbot::SteadyClock>();
    youbot::RobotOptions options;
    options.name = name;
    options.ethercat.kind = arm ? youbot::YoubotKind::kBaseAndArm : youbot::YoubotKind::kBase;
    options.simulation.on_ground = on_ground;
    opened_ = youbot::open_robot(options, *clock_, period_);
    using Wheels = youbot::MonitoredRobot::Wheels;
    robot_.emplace(*opened_.robot, on_ground ? Wheels::kRolling : Wheels::kFree);
  }

  void activate() {
    const Turn turn(*this);
    robot_->activate();
    begin_ = deadline_ = clock_->now();
    command_ = {};
  }
  void deactivate() {
    const Turn turn(*this);
    robot_->deactivate();
  }

  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const youbot::JointInfo& joint : robot_->joints()) names.push_back(joint.name);
    return names;
  }

  State step(const Targets& torque_Nm, const Targets& velocity_rad_per_s, const Targets& position_rad) {
    if (torque_Nm.has_value() + velocity_rad_per_s.has_value() + position_rad.has_value() > 1)
      throw std::invalid_argument("command torque, velocity or position, one of them");
    const Turn turn(*this);
    using youbot::CommandMode;
    set(CommandMode::kTorque, torque_Nm ? *torque_Nm : Eigen::VectorXd::Zero(count()));
    if (velocity_rad_per_s) set(CommandMode::kVelocity, *velocity_rad_per_s);
    if (position_rad) set(CommandMode::kPosition, *position_rad);
    return exchange();
  }

  /// Without success the drives are ordered off, so that a later step() does not enable them.
  State enable(double timeout_s) {
    const nanoseconds timeout = nanoseconds_of("timeout_s", timeout_s, 0, 3600);
    const nanoseconds last = clock_->now() + timeout;
    try {
      for (;;) {
        State state = ask_to_enable(last);
        if (state.enabled) return state;
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      }
    } catch (...) {
      const Turn turn(*this);
      command_ = {};
      (void)robot_->exchange(command_, sample_);
      throw;
    }
  }
  State disable() {
    const Turn turn(*this);
    command_ = {};
    return exchange();
  }

 private:
  /// One thread at a time, which lets other threads of Python run meanwhile.
  class Turn {
   public:
    explicit Turn(Robot& robot) : lock_(robot.mutex_) {}

   private:
    py::gil_scoped_release release_;  // before the lock, or a thread that has it could wait for ever
    std::scoped_lock<std::mutex> lock_;
  };

  State ask_to_enable(nanoseconds last) {
    const Turn turn(*this);
    command_.enable = true;
    set(youbot::CommandMode::kTorque, Eigen::VectorXd::Zero(count()));
    State state = exchange();
    if (!state.enabled && clock_->now() >= last)
      throw RobotFault("the drives do not obey: check the emergency stop and the 24 V");
    return state;
  }

  Eigen::Index count() const { return static_cast<Eigen::Index>(robot_->joints().size()); }

  void set(youbot::CommandMode mode, const Eigen::VectorXd& targets) {
    if (targets.size() != count())
      throw std::invalid_argument("a command has a number for each of the " + std::to_string(count()) +
                                  " joints, not " + std::to_string(targets.size()));
    for (Eigen::Index i = 0; i < count(); ++i)
      command_.joints[static_cast<std::size_t>(i)] = {mode, targets[i]};
  }

  State exchange() {
    clock_->sleep_until(deadline_ += period_);
    const youbot::CycleStatus status = robot_->exchange(command_, sample_);
    // A notebook may pause at any time: missed periods are skipped.
    if (clock_->now() > deadline_ + period_) deadline_ = clock_->now();
    if (!status.ok()) {
      const std::string joint =
          status.joint >= 0 ? names()[static_cast<std::size_t>(status.joint)] + ": " : "";
      throw RobotFault(joint + robot_->explain(status));
    }
    State state;
    state.time_s = std::chrono::duration<double>(sample_.stamp - begin_).count();
    state.enabled = sample_.enabled;
    for (Eigen::VectorXd* of : {&state.position_rad, &state.velocity_rad_per_s, &state.torque_Nm})
      of->resize(count());
    for (Eigen::Index i = 0; i < count(); ++i) {
      const youbot::JointSample& joint = sample_.joints[static_cast<std::size_t>(i)];
      state.position_rad[i] = joint.position_rad;
      state.velocity_rad_per_s[i] = joint.velocity_rad_per_s;
      state.torque_Nm[i] = joint.torque_Nm;
    }
    return state;
  }

  std::mutex mutex_;
  nanoseconds period_;
  std::unique_ptr<youbot::Clock> clock_;
  youbot::OpenedRobot opened_;
  std::optional<youbot::MonitoredRobot> robot_;
  youbot::RobotCommand command_;
  youbot::RobotSample sample_;
  nanoseconds begin_{};
  nanoseconds deadline_{};
};

}  // namespace

void add_robot(py::module_& module) {
  py::register_exception<RobotFault>(module, "RobotFault", PyExc_RuntimeError);
  py::class_<State>(module, "State", "Measured values of the joints, in the order of Robot.names.")
      .def_readonly("time_s", &State::time_s, "Time since the robot was activated.")
      .def_readonly("enabled", &State::enabled, "Whether the drives obey.")
      .def_readonly("position_rad", &State::position_rad)
      .def_readonly("velocity_rad_per_s", &State::velocity_rad_per_s)
      .def_readonly("torque_Nm", &State::torque_Nm, "From the motors' currents.");
  py::class_<Robot>(module, "Robot", R"(A robot, selected by name: loopback, wire, ethercat:IFACE, can:IFACE.

    with youbot.Robot("loopback", on_ground=False) as robot:
        robot.enable()
        for _ in range(1000):
            state = robot.step(torque_Nm=[0.1, 0, 0, 0])

A simulated robot runs in virtual time, as fast as possible. With a real robot each step waits for its period. Python
keeps the period most of the time; if it pauses for longer, the motor controllers' own watchdogs stop the drives. Write
a controller that must not miss a period in C++ (examples/own_controller.cpp). Each step checks the sensors.

on_ground: whether the wheels carry the robot. arm: whether the base has an arm.)")
      .def(py::init<const std::string&, double, bool, bool>(), py::arg("name") = "loopback", py::kw_only(),
           py::arg("period_s") = 1e-3, py::arg("on_ground") = true, py::arg("arm") = false)
      .def(
          "__enter__",
          [](Robot& robot) -> Robot& {
            robot.activate();
            return robot;
          },
          py::return_value_policy::reference)
      .def("__exit__", [](Robot& robot, const py::args& /*error*/) { robot.deactivate(); })
      .def_property_readonly("names", &Robot::names, "Names of the joints, in bus order.")
      .def("enable", &Robot::enable, py::arg("timeout_s") = 30.0, "Waits until the drives obey.")
      .def("disable", &Robot::disable, "Switches the drives off and clears a fault.")
      .def(
          "step", &Robot::step, py::kw_only(), py::arg("torque_Nm") = std::nullopt,
          py::arg("velocity_rad_per_s") = std::nullopt, py::arg("position_rad") = std::nullopt,
          "Waits for the next period, sends a target for each joint and returns the measured values. Without "
          "a target the torque is zero. Raises RobotFault if a fault switched the drives off.");
}

}  // namespace youbot_python
