// Arms and recordings of them for exported_arm_test.mjs: the motion of each sample, its torque, the torque
// that our model predicts, and the error of our own simulation in short windows. usage: export_arm_motions
// OUT SOURCE
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "analysis/robot_tables.h"
#include "identification/robot_gap/arm_rows.h"
#include "identification/robot_gap/link_motion.h"
#include "runtime/configuration/robot_file.h"
#include "tests/robot_gap/robot_cases.h"

namespace {

namespace fs = std::filesystem;
using control::ArmDescription;
using identification::robot_gap::ArmMotion;
using identification::robot_gap::ArmRecording;
using nlohmann::json;
using robot_gap_test::ArmDesign;
using robot_gap_test::HiddenArm;
using robot_gap_test::HiddenEffect;

constexpr double kBand_Hz = 10;
/// Shorter than the time in which noise of the torque moves an arm far from its path.
constexpr double kWindow_s = 0.1;
constexpr std::size_t kWindows = 60;
/// Slower joints may be at rest.
constexpr double kMoving_rad_per_s = 0.05;

struct Case {
  std::string name;
  std::string urdf;
  ArmDescription arm;  // what a person who knows the arm would write down
  std::vector<ArmRecording> recordings;
};

Eigen::VectorXd reported_Nm(const ArmDescription& arm, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                            const Eigen::MatrixXd& accelerations, Eigen::Index column) {
  ArmMotion state;
  state.period_s = 1;
  state.is_scattered = true;
  state.position_rad = q.replicate(1, accelerations.cols());
  state.velocity_rad_per_s = v.replicate(1, accelerations.cols());
  state.acceleration_rad_per_s2 = accelerations;
  state.torque_Nm = Eigen::MatrixXd::Zero(q.size(), accelerations.cols());
  return identification::robot_gap::predicted_torque_Nm(arm, state).col(column);
}

/// Which acceleration takes this torque, by Newton's method: the torque is nearly linear in it.
Eigen::VectorXd acceleration(const ArmDescription& arm, const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                             const Eigen::VectorXd& torque_Nm) {
  const Eigen::Index n = q.size();
  Eigen::MatrixXd mass(n, n);
  Eigen::VectorXd a = Eigen::VectorXd::Zero(n);
  const Eigen::VectorXd bias = reported_Nm(arm, q, v, a, 0);
  for (Eigen::Index j = 0; j < n; ++j)
    mass.col(j) = reported_Nm(arm, q, v, Eigen::VectorXd::Unit(n, j), 0) - bias;
  const Eigen::PartialPivLU<Eigen::MatrixXd> solver(mass);
  for (int i = 0; i < 3; ++i) a += solver.solve(torque_Nm - reported_Nm(arm, q, v, a, 0));
  return a;
}

/// Runge and Kutta's method of fourth order, with a constant torque.
void step(const ArmDescription& arm, Eigen::VectorXd& q, Eigen::VectorXd& v, const Eigen::VectorXd& torque_Nm,
          double dt) {
  const Eigen::VectorXd a1 = acceleration(arm, q, v, torque_Nm);
  const Eigen::VectorXd v2 = v + dt / 2 * a1;
  const Eigen::VectorXd a2 = acceleration(arm, q + dt / 2 * v, v2, torque_Nm);
  const Eigen::VectorXd v3 = v + dt / 2 * a2;
  const Eigen::VectorXd a3 = acceleration(arm, q + dt / 2 * v2, v3, torque_Nm);
  const Eigen::VectorXd v4 = v + dt * a3;
  const Eigen::VectorXd a4 = acceleration(arm, q + dt * v3, v4, torque_Nm);
  q += dt / 6 * (v + 2 * v2 + 2 * v3 + v4);
  v += dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
}

bool keeps_moving(const ArmMotion& motion, Eigen::Index first, Eigen::Index length) {
  const auto v = motion.velocity_rad_per_s.middleCols(first, length).array();
  return ((v > kMoving_rad_per_s).rowwise().all() || (v < -kMoving_rad_per_s).rowwise().all()).all();
}

json array_of(const Eigen::MatrixXd& samples) {
  json rows = json::array();
  for (Eigen::Index i = 0; i < samples.cols(); ++i)
    rows.push_back(std::vector<double>(samples.col(i).begin(), samples.col(i).end()));
  return rows;
}

json motion_json(const ArmDescription& arm, const ArmMotion& motion, std::vector<double>& squares) {
  const bool is_elastic =
      std::ranges::any_of(arm.drives, [](const auto& drive) { return drive.compliance_rad_per_Nm > 0; });
  const auto link = identification::robot_gap::link_motion(arm, motion);
  Eigen::MatrixXd zeros(motion.position_rad.rows(), 1);
  for (std::size_t j = 0; j < arm.drives.size(); ++j)
    zeros(static_cast<Eigen::Index>(j), 0) = arm.drives[j].encoder_zero_rad;
  json result{{"period_s", motion.period_s},
              {"q", array_of(motion.position_rad)},
              {"v", array_of(motion.velocity_rad_per_s)},
              {"a", array_of(motion.acceleration_rad_per_s2)},
              {"torque", array_of(motion.torque_Nm)},
              {"ours", array_of(identification::robot_gap::predicted_torque_Nm(arm, motion))},
              {"windows", json::array()}};
  if (is_elastic) {
    // As an encoder would show the links, without their springs.
    result["link_q"] = array_of(link.q_rad - zeros.replicate(1, link.q_rad.cols()));
    result["link_v"] = array_of(link.v_rad_per_s);
    result["link_a"] = array_of(link.a_rad_per_s2);
    return result;
  }
  const auto length = static_cast<Eigen::Index>(std::round(kWindow_s / motion.period_s));
  result["window_samples"] = length;
  for (Eigen::Index first = 0; first + length < motion.position_rad.cols(); first += length) {
    if (result["windows"].size() == kWindows) break;
    if (!keeps_moving(motion, first, length + 1)) continue;
    result["windows"].push_back(first);
    Eigen::VectorXd q = motion.position_rad.col(first);
    Eigen::VectorXd v = motion.velocity_rad_per_s.col(first);
    for (Eigen::Index i = first; i < first + length; ++i) {
      step(arm, q, v, motion.torque_Nm.col(i), motion.period_s);
      squares.push_back((v - motion.velocity_rad_per_s.col(i + 1)).squaredNorm());
    }
  }
  return result;
}

void write_case(const fs::path& out, const Case& one) {
  const fs::path directory = out / one.name;
  fs::create_directories(directory);
  std::ofstream(directory / "arm.urdf") << one.urdf;
  const ArmDescription given{.arm = control::read_serial_arm(one.urdf, "base", "tip"),
                             .drives = one.arm.drives};
  runtime::RobotFile file;
  file.name = one.name;
  file.base = "base";
  file.tip = "tip";
  file.arm = one.arm;
  for (std::size_t j = 0; j < one.arm.drives.size(); ++j) {
    file.columns.position.push_back("q" + std::to_string(j + 1) + "_rad");
    file.columns.torque.push_back("tau" + std::to_string(j + 1) + "_Nm");
    file.columns.position_factor.push_back(1);
    file.columns.torque_factor.push_back(1);
  }
  std::ofstream(directory / "robot.toml") << runtime::robot_file_text(file, "arm.urdf", given, {}, {});
  json motions = json::array();
  std::vector<double> squares;
  for (const ArmRecording& recording : one.recordings)
    motions.push_back(
        motion_json(one.arm, identification::robot_gap::filtered(recording, kBand_Hz), squares));
  double sum = 0;
  for (const double square : squares) sum += square;
  const double ours = std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, squares.size())));
  if (!std::isfinite(ours)) throw std::runtime_error(one.name + ": our simulation is unstable");
  std::ofstream(directory / "motions.json") << json{{"ours_rad_per_s", ours}, {"motions", motions}};
}

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// The published arm with the friction and the torque constant that its slow recording shows; the fast ones
/// judge.
Case measured_arm(const fs::path& source, bool is_load_dependent) {
  const fs::path data = source / "tests/data/two_link_arm";
  const runtime::RobotFile robot = runtime::read_robot_file(data / "robot.toml");
  Case one{is_load_dependent ? "two_link_arm_load_friction" : "two_link_arm",
           text_of(data / "arm.urdf"),
           robot.arm,
           {}};
  one.arm.drives[0].torque_scale = 1.0445;
  one.arm.drives[0].coulomb_Nm = is_load_dependent ? 0.144 : 0.19;
  one.arm.drives[0].load_friction = is_load_dependent ? 0.0728 : 0;
  one.arm.drives[1].coulomb_Nm = 0.161;
  analysis::RobotGapOptions slow;
  slow.model = data / "robot.toml";
  slow.data = {data / "A_slow_75s.csv"};
  const ArmRecording whole = analysis::read_arm_recordings(robot, slow).data.front();
  const auto rows = static_cast<Eigen::Index>(whole.time_s.size());
  const Eigen::Index last = rows / 4;
  one.recordings.push_back({"last quarter",
                            {whole.time_s.end() - last, whole.time_s.end()},
                            whole.position_rad.rightCols(last),
                            whole.torque_Nm.rightCols(last)});
  return one;
}

/// DART hides what the published description lacks, and the model has it.
Case hidden_arm(const ArmDesign& design, const std::vector<HiddenEffect>& hidden) {
  HiddenArm truth(design, hidden);
  Case one{"dart_" + design.name, urdf_of(design), robot_gap_test::published(design, truth.friction()), {}};
  ArmDescription& arm = one.arm;
  for (const HiddenEffect& effect : hidden) {
    control::ArmDrive& drive = arm.drives[static_cast<std::size_t>(std::max(0, effect.part))];
    if (effect.effect == "payload") {
      arm.payload_kg = effect.size;
      arm.p_TP_m = {0.02, 0.01, -0.015};
    } else if (effect.effect == "gravity_direction") {
      const double s = std::sin(effect.size);
      arm.gravity_B_m_per_s2 = 9.81 * Eigen::Vector3d(0.8 * s, -0.6 * s, -std::cos(effect.size));
    } else if (effect.effect == "encoder_zero") {
      drive.encoder_zero_rad = effect.size;
    } else if (effect.effect == "torque_constant") {
      drive.torque_scale = 1 + effect.size;
    } else if (effect.effect == "rotor_inertia") {
      drive.rotor_inertia_kg_m2 = effect.size;
    } else if (effect.effect == "torque_offset") {
      drive.offset_Nm = effect.size;
    } else if (effect.effect == "spring") {
      drive.spring_Nm_per_rad = effect.size;
      drive.spring_rest_rad = 0.3;
    } else {
      throw std::invalid_argument("no place for " + effect.effect);
    }
  }
  one.recordings.push_back(
      robot_gap_test::as_recorded(truth.record({.seconds = 12, .seed = 7, .lag_s = 1e-4}, "other")));
  return one;
}

/// Effects that DART's arms do not have: their truth is our own model, with noise.
Case arm_of_every_effect(bool is_elastic) {
  Case one = hidden_arm(robot_gap_test::elbow_arm(), {{"rotor_inertia", 0, 0.4},
                                                      {"rotor_inertia", 1, 0.3},
                                                      {"rotor_inertia", 2, 0.2},
                                                      {"rotor_inertia", 3, 0.02}});
  one.name = is_elastic ? "elastic_gear" : "every_effect";
  for (control::ArmDrive& drive : one.arm.drives) drive.encoder_zero_rad = 0.1;
  control::ArmDrive& first = one.arm.drives[0];
  control::ArmDrive& second = one.arm.drives[1];
  control::ArmDrive& third = one.arm.drives[2];
  first.stribeck_Nm = 2;
  first.stribeck_speed_rad_per_s = 0.4;
  first.quadratic_drag_Nm_s2_per_rad2 = 0.3;
  if (!is_elastic) second.ripples = {{7, 0.8, 0.5}, {12.5, 0.4, -0.3}};
  third.cable_2_Nm_per_rad2 = 1.5;
  third.cable_3_Nm_per_rad3 = -0.7;
  third.spring_Nm_per_rad = 2;
  third.spring_rest_rad = 0.4;
  if (is_elastic) {
    second.compliance_rad_per_Nm = 2e-4;
    second.friction_before_gear = true;
  }
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  ArmRecording& recording = one.recordings.front();
  const ArmMotion motion = identification::robot_gap::filtered(recording, kBand_Hz);
  const Eigen::MatrixXd torque_Nm = identification::robot_gap::predicted_torque_Nm(one.arm, motion);
  recording.torque_Nm.resize(torque_Nm.rows(), torque_Nm.cols());
  recording.position_rad = motion.position_rad;
  recording.time_s.clear();
  for (Eigen::Index i = 0; i < torque_Nm.cols(); ++i) {
    recording.time_s.push_back(static_cast<double>(i) * motion.period_s);
    for (Eigen::Index j = 0; j < torque_Nm.rows(); ++j)
      recording.torque_Nm(j, i) = torque_Nm(j, i) + 0.02 * normal(random);
  }
  return one;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 3) throw std::invalid_argument("usage: export_arm_motions OUT SOURCE");
    const std::vector<Case> cases{
        measured_arm(argv[2], false),
        measured_arm(argv[2], true),
        hidden_arm(robot_gap_test::planar_arm(),
                   {{"gravity_direction", -1, 0.05}, {"encoder_zero", 1, 0.06}, {"payload", -1, 0.4}}),
        hidden_arm(robot_gap_test::elbow_arm(), {{"payload", -1, 0.5},
                                                 {"encoder_zero", 2, 0.05},
                                                 {"spring", 1, 6},
                                                 {"torque_offset", 3, 0.3},
                                                 {"rotor_inertia", 0, 0.3},
                                                 {"torque_constant", 1, -0.08}}),
        hidden_arm(robot_gap_test::industrial_arm(), {{"payload", -1, 1.0},
                                                      {"encoder_zero", 1, 0.04},
                                                      {"gravity_direction", -1, 0.03},
                                                      {"rotor_inertia", 4, 0.05},
                                                      {"torque_offset", 5, 0.1}}),
        arm_of_every_effect(false),
        arm_of_every_effect(true),
    };
    for (const Case& one : cases) write_case(argv[1], one);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "export_arm_motions: %s\n", error.what());
    return 1;
  }
}
