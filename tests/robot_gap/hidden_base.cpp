#include "tests/robot_gap/hidden_base.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

namespace robot_gap_test {
namespace {

constexpr double kStep_s = 1e-3;
constexpr double kSlew_s = 0.12;  // of each of two low-passes between a command and the wheels
constexpr double kEncoderCounts = 2797;
constexpr double kCurrentStep_A = 0.0256;
constexpr double kTorqueNoise_Nm = 0.003;
constexpr double kTorqueStep_Nm = 0.002;
constexpr double kPi = std::numbers::pi;

double rounded(double value, double step) { return step > 0 ? std::round(value / step) * step : value; }

/// A direction in which a wheel grips the floor: its surface there and the base must move alike.
struct Grip {
  Eigen::Vector2d at_m;
  Eigen::Vector2d along;
  int wheel = -1;    // whose surface speed drives it; −1: it must not move
  double share = 1;  // of that speed
};

std::vector<Grip> grips_of(const BaseDesign& base, double steering_rad) {
  const auto heading = [](double angle) { return Eigen::Vector2d(std::cos(angle), std::sin(angle)); };
  const auto across = [](double angle) { return Eigen::Vector2d(-std::sin(angle), std::cos(angle)); };
  std::vector<Grip> grips;
  switch (base.kinematics) {
    case Kinematics::kDifferential:
      for (int i = 0; i < 2; ++i) {
        const Eigen::Vector2d at(0, (i == 0 ? 0.5 : -0.5) * base.track_m);
        grips.push_back({at, heading(0), i});
        grips.push_back({at, across(0)});
      }
      break;
    case Kinematics::kTricycle: {
      const Eigen::Vector2d front(base.wheelbase_m, 0);
      grips.push_back({front, heading(steering_rad), 0});
      grips.push_back({front, across(steering_rad)});
      grips.push_back({Eigen::Vector2d::Zero(), across(0)});
      break;
    }
    case Kinematics::kOmni:
      for (std::size_t i = 0; i < base.wheels.size(); ++i) {
        const double angle = base.wheels[i].angle_rad;
        grips.push_back({base.radius_m * heading(angle), across(angle), static_cast<int>(i)});
      }
      break;
    case Kinematics::kMecanum:
      for (int i = 0; i < 4; ++i) {
        const double front = i < 2 ? 1 : -1;
        const double left = i % 2 == 0 ? 1 : -1;
        // Rollers touch the floor along lines that meet behind and before the base; left wheels count
        // backwards.
        const Eigen::Vector2d axis = Eigen::Vector2d(1, -front * left).normalized();
        grips.push_back({{front * base.wheelbase_m / 2, left * base.track_m / 2}, axis, i, -left * axis.x()});
      }
      break;
  }
  return grips;
}

/// Of the base's twist: how fast the floor passes under a grip.
Eigen::RowVector3d row_of(const Grip& grip) {
  return {grip.along.x(), grip.along.y(), grip.at_m.x() * grip.along.y() - grip.at_m.y() * grip.along.x()};
}

/// Twist, or front speed and steering of a tricycle, for a time.
struct Command {
  double seconds;
  Eigen::Vector3d target;
};

/// Motions that people record: with stops, both ways round.
class Commands {
 public:
  Commands(const BaseDesign& base, const BasePlan& plan, std::mt19937_64& random)
      : base_(base), speed_(base.speed_m_per_s * plan.tempo), random_(random) {
    stop(1);
    for (int lap = 0; seconds_ < plan.seconds; ++lap) {
      const double way = lap % 2 == 0 ? 1 : -1;
      switch (plan.motion) {
        case BaseMotion::kSquares: square(way); break;
        case BaseMotion::kCircles: circle(way); break;
        case BaseMotion::kLines: line(); break;
        case BaseMotion::kFree: wander(); break;
      }
    }
    stop(1);
  }
  const std::vector<Command>& list() const { return list_; }

 private:
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  void add(double seconds, double a, double b = 0, double c = 0) {
    list_.push_back({seconds, {a, b, c}});
    seconds_ += seconds;
  }
  void stop(double seconds) { add(seconds, 0); }
  bool steers() const { return base_.kinematics == Kinematics::kTricycle; }
  bool sideways() const {
    return base_.kinematics == Kinematics::kOmni || base_.kinematics == Kinematics::kMecanum;
  }
  void square(double way) {
    const double side_s = base_.path_m / speed_ * between(0.9, 1.1);
    if (sideways() && between(0, 1) < 0.5) {  // without turning
      for (const auto& [x, y] : {std::pair{1., 0.}, {0., way}, {-1., 0.}, {0., -way}}) {
        add(side_s, speed_ * x, speed_ * y);
        stop(0.8);
      }
      add(1.5, 0, 0, way * 0.8);
      return stop(0.8);
    }
    for (int corner = 0; corner < 4; ++corner) {
      add(side_s, speed_);
      stop(0.8);
      if (steers()) {
        const double steering = way * 1.1;
        add(0.8, 0, steering);
        add(kPi / 2 * base_.wheelbase_m / (0.6 * speed_ * std::sin(1.1)), 0.6 * speed_, steering);
        add(0.8, 0, steering);
      } else {
        add(kPi / 2 / 0.9, 0, 0, way * 0.9);
      }
      stop(0.8);
    }
  }
  void circle(double way) {
    const double radius = base_.path_m * between(0.3, 0.5);
    const double turn_s = 2 * kPi * radius / speed_;
    if (steers()) {
      const double steering = way * std::atan(base_.wheelbase_m / radius);
      add(0.8, 0, steering);
      add(turn_s, speed_, steering);
      add(0.8, 0, steering);
    } else if (sideways() && between(0, 1) < 0.5) {  // looks outwards
      add(turn_s, 0, way * speed_, way * speed_ / radius);
    } else {
      add(turn_s, speed_, 0, way * speed_ / radius);
    }
    stop(1);
  }
  void line() {
    const double angle = sideways() ? between(-kPi, kPi) : 0;
    for (const double way : {1, -1}) {
      if (steers())
        add(base_.path_m / speed_, way * speed_);
      else
        add(base_.path_m / speed_, way * speed_ * std::cos(angle), way * speed_ * std::sin(angle));
      stop(1);
    }
  }
  void wander() {
    const double speed = speed_ * between(0.4, 1.2);
    if (steers())
      add(between(0.8, 2), speed, between(-0.9, 0.9));
    else if (const double angle = between(-kPi, kPi); sideways())
      add(between(0.8, 2), speed * std::cos(angle), speed * std::sin(angle), between(-0.8, 0.8));
    else
      add(between(0.8, 2), speed, 0, between(-1, 1));
    if (between(0, 1) < 0.12) stop(1.5);
    if (between(0, 1) < 0.12 && !sideways()) add(1.5, -0.7 * speed);
  }

  const BaseDesign& base_;
  double speed_;
  std::mt19937_64& random_;
  std::vector<Command> list_;
  double seconds_ = 0;
};

/// Torques that the wheels need for a motion, by Newton's law in the world: forces along the grips balance
/// what the centre of mass does.
class Efforts {
 public:
  Efforts(const HiddenBase& base, const BasePlan& plan) : base_(base), plan_(plan) {}

  /// After a step. `surface`: steering angle as it is.
  void step(const Eigen::Vector3d& pose, const Eigen::Vector3d& twist, const Eigen::VectorXd& turned,
            const Eigen::VectorXd& rate, const Eigen::VectorXd& acceleration, double steering_rad,
            double share_of_run, double time_s) {
    const Eigen::Vector2d centre = base_.actual().centre_m;
    const Eigen::Vector2d at = pose.head<2>() + Eigen::Rotation2Dd(pose[2]) * centre;
    places_.emplace_back(at.x(), at.y(), pose[2]);
    if (places_.size() > 3) places_.erase(places_.begin());
    torque_ = Eigen::VectorXd::Zero(rate.size());
    if (places_.size() < 3) return;
    // All is of the time of the middle one.
    const Eigen::Rotation2Dd to_world(places_[1][2]);
    const Eigen::Vector3d moved = (places_[2] - 2 * places_[1] + places_[0]) / (kStep_s * kStep_s);
    double mass = base_.actual().mass_kg;
    if (share_of_run > 0.5) mass *= 1 + base_.size_of("payload_put_on", "base");
    Eigen::Vector2d force = mass * (moved.head<2>() + 9.81 * slope());
    force.x() += base_.size_of("gusts", "base") * std::sin(0.9 * time_s + 1);
    force = to_world.inverse() * force;
    Eigen::Vector3d wrench(
        force.x(), force.y(),
        base_.actual().yaw_inertia_kg_m2 * moved[2] + centre.x() * force.y() - centre.y() * force.x());
    wrench[1] += base_.size_of("sideways_resistance", "base") * std::tanh(twist[1] / 0.004);
    wrench[2] += base_.size_of("turning_resistance", "base") * std::tanh(twist[2] / 0.015);
    const std::vector<Grip> grips = grips_of(base_.actual(), steering_rad);
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(grips.size()), 3);
    for (std::size_t g = 0; g < grips.size(); ++g) rows.row(static_cast<Eigen::Index>(g)) = row_of(grips[g]);
    // Grips that are more than needed press against each other as they happen to.
    const Eigen::MatrixXd back = rows.transpose().completeOrthogonalDecomposition().pseudoInverse();
    Eigen::VectorXd pushes = back * wrench;
    const Eigen::VectorXd strain = Eigen::VectorXd::Constant(rows.rows(), 1.5 * std::sin(0.4 * time_s));
    pushes += strain - back * (rows.transpose() * strain);
    for (std::size_t g = 0; g < grips.size(); ++g) {
      if (grips[g].wheel < 0) continue;
      const BaseDesign::Wheel& wheel = base_.actual().wheels[static_cast<std::size_t>(grips[g].wheel)];
      torque_[grips[g].wheel] += pushes[static_cast<Eigen::Index>(g)] * grips[g].share * wheel.radius_m;
    }
    for (Eigen::Index i = 0; i < rate.size(); ++i)
      torque_[i] = reported(i, turned[i], rate[i], acceleration[i]);
  }
  const Eigen::VectorXd& torque() const { return torque_; }

 private:
  Eigen::Vector2d slope() const {
    for (const BaseEffect& one : base_.effects())
      if (one.effect == "floor_slope") return {one.size, one.size_y};
    return Eigen::Vector2d::Zero();
  }
  double reported(Eigen::Index i, double turned, double rate, double acceleration) const {
    const BaseDesign::Wheel& wheel = base_.actual().wheels[static_cast<std::size_t>(i)];
    const auto count = static_cast<double>(base_.actual().wheels.size());
    const auto hidden = [&](std::string_view effect) {
      return base_.size_of(effect, wheel.name) + base_.size_of(effect, "base");
    };
    double friction = wheel.coulomb_Nm + hidden("coulomb");
    if (!plan_.floor.empty())
      friction += base_.size_of("floor_resistance", plan_.floor) * wheel.radius_m / count;
    const double torque = torque_[i] + friction * std::tanh(rate / 0.05) +
                          (wheel.viscous_Nm_s + hidden("viscous")) * rate +
                          (wheel.inertia_kg_m2 + hidden("wheel_inertia")) * acceleration +
                          hidden("torque_offset") + hidden("torque_ripple") * std::sin(3 * turned);
    return torque / (1 + hidden("torque_constant"));
  }

  const HiddenBase& base_;
  const BasePlan& plan_;
  std::vector<Eigen::Vector3d> places_;
  Eigen::VectorXd torque_;
};

/// One recording's motion, a millisecond at a time.
class Drive {
 public:
  Drive(const HiddenBase& base, const BasePlan& plan)
      : base_(base),
        plan_(plan),
        random_(plan.seed),
        commands_(base.design(), plan, random_),
        wheels_(static_cast<Eigen::Index>(base.design().wheels.size())),
        turned_(Eigen::VectorXd::Zero(wheels_)),
        load_(Eigen::VectorXd::Zero(wheels_)),
        rate_(Eigen::VectorXd::Zero(wheels_)),
        behind_backlash_(Eigen::VectorXd::Zero(wheels_)),
        efforts_(base, plan) {
    std::uniform_real_distribution<double> uniform(0, 1);
    pose_ = {uniform(random_) - 0.5, uniform(random_) - 0.5, 2 * kPi * uniform(random_)};
    for (double& phase : phases_) phase = 2 * kPi * uniform(random_);
    for (const Command& one : commands_.list()) seconds_ += one.seconds;
  }
  double seconds() const { return seconds_; }
  const Eigen::Vector3d& pose() const { return pose_; }      // x, y, heading in the world
  const Eigen::VectorXd& turned() const { return turned_; }  // what the encoders count
  const Eigen::VectorXd& load() const { return load_; }
  const Eigen::VectorXd& torque() const { return efforts_.torque(); }
  double steering() const { return base_.design().kinematics == Kinematics::kTricycle ? filtered_[1] : 0; }
  std::mt19937_64& random() { return random_; }

  void step() {
    const Eigen::Vector3d wanted = slewed();
    const Eigen::VectorXd before = rate_;
    rate_ = wheel_rates(wanted);
    const Eigen::VectorXd acceleration = (rate_ - before) / kStep_s;
    Eigen::VectorXd surface(wheels_);
    for (Eigen::Index i = 0; i < wheels_; ++i) surface[i] = surface_speed(i, acceleration[i]);
    Eigen::Vector3d twist =
        base_.rolling_twist(surface, steering() + base_.size_of("steering_offset", "steering"));
    lose(twist);
    const double heading = pose_[2] + twist[2] * kStep_s / 2;
    pose_[0] += (twist[0] * std::cos(heading) - twist[1] * std::sin(heading)) * kStep_s;
    pose_[1] += (twist[0] * std::sin(heading) + twist[1] * std::cos(heading)) * kStep_s;
    pose_[2] += twist[2] * kStep_s;
    time_s_ += kStep_s;
    if (base_.actual().mass_kg > 0)
      efforts_.step(pose_, twist, turned_, 0.5 * (before + rate_), acceleration,
                    steering() + base_.size_of("steering_offset", "steering"), time_s_ / seconds_, time_s_);
  }

 private:
  Eigen::Vector3d slewed() {
    const std::vector<Command>& list = commands_.list();
    while (command_ + 1 < list.size() && time_s_ - command_begin_s_ > list[command_].seconds)
      command_begin_s_ += list[command_++].seconds;
    const double share = 1 - std::exp(-kStep_s / kSlew_s);
    middle_ += share * (list[command_].target - middle_);
    filtered_ += share * (middle_ - filtered_);
    return filtered_;
  }
  /// By the published geometry, and not quite as wanted.
  Eigen::VectorXd wheel_rates(const Eigen::Vector3d& wanted) const {
    Eigen::VectorXd rates(wheels_);
    for (const Grip& grip : grips_of(base_.design(), 0)) {
      if (grip.wheel < 0) continue;
      const auto i = static_cast<std::size_t>(grip.wheel);
      const double speed = base_.design().kinematics == Kinematics::kTricycle
                               ? wanted[0]
                               : row_of(grip).dot(wanted) / grip.share;
      const double ripple = std::sin(3.1 * time_s_ + phases_[i]) + std::sin(7.3 * time_s_ + phases_[i + 4]);
      rates[grip.wheel] = speed / base_.design().wheels[i].radius_m * (1 + 0.015 * ripple);
    }
    return rates;
  }
  /// Counts the encoder and returns how fast the wheel's surface pulls at the floor.
  double surface_speed(Eigen::Index i, double acceleration) {
    const BaseDesign::Wheel& wheel = base_.actual().wheels[static_cast<std::size_t>(i)];
    const auto hidden = [&](std::string_view effect) { return base_.size_of(effect, wheel.name); };
    const double rate = rate_[i];
    const double speed = std::abs(rate) * wheel.radius_m;
    load_[i] = std::abs((1 + 0.25 * std::cos(2. * static_cast<double>(i) + 1)) *
                            (0.2 * std::tanh(std::abs(rate) / 0.3) + 1.1 * speed) +
                        0.35 * std::copysign(acceleration, acceleration * rate) * wheel.radius_m);
    double kept = 1 - load_[i] * base_.size_of("slip_with_load", "base");
    if (!plan_.floor.empty()) kept *= 1 - base_.size_of("floor_slip", plan_.floor);
    // Outside of what can be named.
    kept *= 1 - std::min(0.6, base_.size_of("acceleration_slip", "base") * std::abs(acceleration) *
                                  wheel.radius_m);
    if (pose_.head<2>().norm() < 0.6) kept *= 1 - base_.size_of("slippery_patch", "base");
    kept *= 1 + hidden("eccentric_wheel") * std::cos(turned_[i]);
    const double worn = plan_.worn_from + (plan_.worn_to - plan_.worn_from) * time_s_ / seconds_;
    kept *= 1 - hidden("worn_tyre") * worn;
    double counted = rate;
    if (hidden("lost_counts") > 0 && speed > 0.8 * base_.design().speed_m_per_s)
      counted *= 1 - hidden("lost_counts");
    if (hidden("stuck_wheel") > 0 && std::fmod(time_s_, 17.) > 15.5) {
      counted = 0;  // it slides, dragged by the others
      kept *= 1 - hidden("stuck_wheel");
    }
    turned_[i] += counted * kStep_s;
    double rolled = rate;
    if (const double play = hidden("backlash"); play > 0) {
      const double behind = std::clamp(behind_backlash_[i], turned_[i] - play / 2, turned_[i] + play / 2);
      rolled = (behind - behind_backlash_[i]) / kStep_s;
      behind_backlash_[i] = behind;
    }
    return rolled * wheel.radius_m * kept;
  }
  void lose(Eigen::Vector3d& twist) {
    const double forward = twist[0];
    twist[0] *= 1 - base_.size_of("slip_forward", "base");
    twist[1] *= 1 - base_.size_of("slip_sideways", "base");
    // Outside of what can be named.
    twist[0] *= 1 - std::min(0.6, base_.size_of("speed_slip", "base") * forward * forward);
    twist[1] -= base_.size_of("skid", "base") * forward * twist[2];
    twist[0] += base_.size_of("sheared_rollers", "base") * twist[1];
    if (const double kick = base_.size_of("caster_pull", "base"); kick > 0 && std::abs(forward) > 0.02) {
      if (forward * last_forward_ < 0) kick_until_s_ = time_s_ + 0.6;
      last_forward_ = forward;
      if (time_s_ < kick_until_s_) twist[2] += kick / 0.6 * std::copysign(1., forward);
    }
  }

  const HiddenBase& base_;
  const BasePlan& plan_;
  std::mt19937_64 random_;
  Commands commands_;
  Eigen::Index wheels_;
  Eigen::Vector3d pose_;
  Eigen::VectorXd turned_;
  Eigen::VectorXd load_;
  Eigen::VectorXd rate_;
  Eigen::VectorXd behind_backlash_;
  Efforts efforts_;
  std::array<double, 8> phases_{};
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d filtered_ = Eigen::Vector3d::Zero();
  std::size_t command_ = 0;
  double command_begin_s_ = 0;
  double time_s_ = 0;
  double seconds_ = 0;
  double last_forward_ = 0;
  double kick_until_s_ = 0;
};

}  // namespace

BaseDesign two_wheeler() {
  return {.name = "two-wheeler",
          .kinematics = Kinematics::kDifferential,
          .wheels = {{"left", 0.042}, {"right", 0.042}},
          .track_m = 0.2,
          .speed_m_per_s = 0.25,
          .path_m = 1.5};
}

BaseDesign tricycle() {
  return {.name = "tricycle",
          .kinematics = Kinematics::kTricycle,
          .wheels = {{"front", 0.0325}},
          .wheelbase_m = 0.15,
          .speed_m_per_s = 0.22,
          .path_m = 1.5};
}

BaseDesign omni_base() {
  return {.name = "omni",
          .kinematics = Kinematics::kOmni,
          .wheels = {{"wheel1", 0.05, kPi / 3}, {"wheel2", 0.05, kPi}, {"wheel3", 0.05, -kPi / 3}},
          .radius_m = 0.19,
          .speed_m_per_s = 0.25,
          .path_m = 1.5};
}

BaseDesign mecanum_base() {
  return {.name = "mecanum",
          .kinematics = Kinematics::kMecanum,
          .wheels = {{"front_left", 0.0475},
                     {"front_right", 0.0475},
                     {"rear_left", 0.0475},
                     {"rear_right", 0.0475}},
          .track_m = 0.3,
          .wheelbase_m = 0.47,
          .speed_m_per_s = 0.3,
          .path_m = 1.7};
}

BaseDesign weighed(BaseDesign base) {
  struct Weight {
    double mass_kg, yaw_inertia_kg_m2, inertia_kg_m2, coulomb_Nm, viscous_Nm_s;
  };
  constexpr std::array<Weight, 4> kWeights{{{5, 0.06, 4e-4, 0.02, 0.003},
                                            {3, 0.03, 3e-4, 0.03, 0.004},
                                            {9, 0.15, 8e-4, 0.03, 0.004},
                                            {25, 1.3, 4e-3, 0.1, 0.02}}};
  const Weight& own = kWeights[static_cast<std::size_t>(base.kinematics)];
  base.mass_kg = own.mass_kg;
  base.yaw_inertia_kg_m2 = own.yaw_inertia_kg_m2;
  for (BaseDesign::Wheel& wheel : base.wheels) {
    wheel.inertia_kg_m2 = own.inertia_kg_m2;
    wheel.coulomb_Nm = own.coulomb_Nm;
    wheel.viscous_Nm_s = own.viscous_Nm_s;
  }
  return base;
}

HiddenBase::HiddenBase(BaseDesign design, std::vector<BaseEffect> effects)
    : design_(std::move(design)), actual_(design_), effects_(std::move(effects)) {
  for (BaseDesign::Wheel& wheel : actual_.wheels)
    wheel.radius_m *= 1 + size_of("wheel_radius", "base") + size_of("wheel_radius", wheel.name);
  const double turning = 1 + size_of("turning_geometry", "base");
  actual_.track_m *= turning;
  actual_.wheelbase_m *= turning;
  actual_.radius_m *= turning;
  actual_.mass_kg *= 1 + size_of("mass", "base");
  actual_.yaw_inertia_kg_m2 *= 1 + size_of("yaw_inertia", "base");
  for (const BaseEffect& one : effects_)
    if (one.effect == "centre_of_mass") actual_.centre_m += Eigen::Vector2d(one.size, one.size_y);
}

double HiddenBase::size_of(std::string_view effect, std::string_view part) const {
  for (const BaseEffect& one : effects_)
    if (one.effect == effect && one.part == part) return one.size;
  return 0;
}

Eigen::Vector3d HiddenBase::rolling_twist(const Eigen::VectorXd& surface_speed_m_per_s,
                                          double steering_rad) const {
  // Each grip pushes in proportion to its slip; a base that is slow against its friction moves so that the
  // pushes cancel.
  Eigen::Matrix3d resistance = Eigen::Matrix3d::Zero();
  Eigen::Vector3d drive = Eigen::Vector3d::Zero();
  for (const Grip& grip : grips_of(actual_, steering_rad)) {
    const Eigen::RowVector3d row = row_of(grip);
    resistance += row.transpose() * row;
    if (grip.wheel >= 0) drive += row.transpose() * grip.share * surface_speed_m_per_s[grip.wheel];
  }
  return resistance.inverse() * drive;
}

BaseRecording HiddenBase::record(const BasePlan& plan, const std::string& name) const {
  Drive drive(*this, plan);
  const auto steps = static_cast<std::size_t>(drive.seconds() / kStep_s);
  const auto every = static_cast<std::size_t>((plan.camera ? 0.04 : 0.02) / kStep_s);
  const auto late = static_cast<std::size_t>(plan.lag_s / kStep_s);
  const double noise_m = plan.camera ? 0.002 : 0.0003;
  const double noise_rad = (plan.camera ? 0.5 : 0.1) * kPi / 180;
  const double step_m = plan.camera ? 0.0018 : 0;
  const double step_rad = plan.camera ? 0.5 * kPi / 180 : 0;
  BaseEffect offset;
  for (const BaseEffect& one : effects_)
    if (one.effect == "tracking_offset") offset = one;
  const double scale = 1 + size_of("tracking_scale", "tracking");

  const auto rows = static_cast<Eigen::Index>(steps / every);
  const auto wheels = static_cast<Eigen::Index>(design_.wheels.size());
  BaseRecording recording{.name = name,
                          .floor = plan.floor,
                          .wheel_rad = Eigen::MatrixXd(wheels, rows),
                          .load = Eigen::MatrixXd(wheels, rows)};
  std::normal_distribution<double> normal;
  std::mt19937_64 torque_random(plan.seed + 1000);
  const auto torques_late = static_cast<std::size_t>(plan.torque_lag_s / kStep_s);
  std::vector<Eigen::VectorXd> torques;
  if (design_.mass_kg > 0) recording.torque_Nm = Eigen::MatrixXd::Zero(wheels, rows);
  std::vector<Eigen::Vector3d> poses;
  poses.reserve(steps);
  for (std::size_t i = 0; i < steps; ++i) {
    poses.push_back(drive.pose());
    if (const auto row = static_cast<Eigen::Index>(i / every); i % every == 0 && row < rows) {
      const double time_s = static_cast<double>(i) * kStep_s;
      recording.time_s.push_back(time_s);
      for (Eigen::Index w = 0; w < wheels; ++w) {
        const double count = 2 * kPi / kEncoderCounts;
        recording.wheel_rad(w, row) = std::floor(drive.turned()[w] / count) * count;
        recording.load(w, row) =
            rounded(std::abs(drive.load()[w] + 0.01 * normal(drive.random())), kCurrentStep_A);
      }
      if (const std::size_t seen = i - std::min(i, torques_late); seen < torques.size())
        for (Eigen::Index w = 0; w < wheels; ++w)
          recording.torque_Nm(w, row) =
              rounded(torques[seen][w] + kTorqueNoise_Nm * normal(torque_random), kTorqueStep_Nm);
      if (design_.kinematics == Kinematics::kTricycle)
        recording.steering_rad.push_back(rounded(drive.steering(), 0.001));
      const Eigen::Vector3d& seen = poses[i - std::min(i, late)];
      const Eigen::Vector2d place(
          seen[0] + offset.size * std::cos(seen[2]) - offset.size_y * std::sin(seen[2]),
          seen[1] + offset.size * std::sin(seen[2]) + offset.size_y * std::cos(seen[2]));
      const double lens = 1 + size_of("lens", "tracking") * place.squaredNorm();
      recording.x_m.push_back(rounded(scale * lens * place.x() + noise_m * normal(drive.random()), step_m));
      recording.y_m.push_back(rounded(scale * lens * place.y() + noise_m * normal(drive.random()), step_m));
      recording.heading_rad.push_back(rounded(seen[2] + size_of("tracking_yaw", "tracking") +
                                                  size_of("heading_drift", "tracking") * time_s +
                                                  noise_rad * normal(drive.random()),
                                              step_rad));
    }
    drive.step();
    if (design_.mass_kg > 0) torques.push_back(drive.torque());
  }
  return recording;
}

}  // namespace robot_gap_test
