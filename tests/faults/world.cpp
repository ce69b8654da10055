#include "tests/faults/world.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <system_error>
#include <utility>

#include "hal/lockstep_haptic_device.h"
#include "hal/loopback_haptic_link.h"
#include "hal/setup_error.h"
#include "sim/bus/bus_link.h"
#include "tests/faults/wall_clock.h"

namespace faults {
namespace {

using namespace std::chrono_literals;

constexpr const char* kBaseConfig = R"(
[ethercat]
kind = "base"
[limits]
force_N = 60
moment_Nm = 20
wheel_torque_Nm = 2.4
wheel_speed_rad_per_s = 12
[path]
speed_m_per_s = 0.3
acceleration_m_per_s2 = 0.5
turn_speed_rad_per_s = 0.5
turn_acceleration_rad_per_s2 = 1.0
)";

/// The arm begins nearly unfolded and is stiff soon, so that a script is mostly about operation.
constexpr const char* kManipulatorConfig = R"(
[ethercat]
kind = "base+arm"
home_arms = true
[haptic]
device = "loopback"
[limits]
force_N = 60
moment_Nm = 20
wheel_torque_Nm = 2.4
wheel_speed_rad_per_s = 16
[teleoperation.start]
approach_s = 4
feedback_fade_s = 0.2
[teleoperation.coupling]
stiffening_N_per_m_s = 6000
stiffening_Nm_per_rad_s = 300
)";

sim::bus::YoubotBusOptions robot_options(Machine machine, std::mt19937_64& random) {
  const auto between = [&random](double low, double high) {
    return std::uniform_real_distribution<>(low, high)(random);
  };
  sim::bus::YoubotBusOptions options;
  options.robot = machine == Machine::kBase ? sim::bus::YoubotKind::kBase : sim::bus::YoubotKind::kBaseAndArm;
  options.coupled = machine == Machine::kManipulator;
  options.base.noise_seed = random();
  options.noise_seed = random();
  const double load = between(0.6, 3.0);
  for (double& scale : options.base.loaded_friction_scale) scale *= load * between(0.9, 1.1);
  options.base.roller_grip = between(0.3, 0.8);
  if (machine == Machine::kManipulator)
    options.scene.walls = {{.p_W_m = {1.08, 0, 0}, .normal_W = -Eigen::Vector3d::UnitX()}};
  return options;
}

rlimit file_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_FSIZE, &limit) != 0)
    throw std::system_error(errno, std::generic_category(), "getrlimit");
  return limit;
}

void set_file_limit(const rlimit& limit) {
  if (setrlimit(RLIMIT_FSIZE, &limit) != 0)
    throw std::system_error(errno, std::generic_category(), "setrlimit");
}

}  // namespace

void World::limit_files(std::uint64_t bytes) { set_file_limit({bytes, file_limit_.rlim_max}); }
void World::restore_files() { set_file_limit(file_limit_); }

World::World(Machine machine, std::uint64_t seed, Sabotage sabotage)
    : machine_(machine), file_limit_(file_limit()), random_(seed), sabotage_(std::move(sabotage)) {
  config_file_ = folder_.write("youbotd.toml", machine == Machine::kBase ? kBaseConfig : kManipulatorConfig);
  config_ = operation::load_config(config_file_);
  emulation_ = std::make_shared<sim::bus::YoubotBus>(robot_options(machine, random_));
  for (std::size_t joint = 0; joint < emulation_->joint_count(); ++joint)
    boards_.push_back(
        std::make_unique<support::LyingBoard>(emulation_->board(joint), emulation_->slave(joint)));
  emulation_->after_each_period([this] {
    if (each_period) each_period();
    if (sabotage_.period) sabotage_.period(*this);
    if (witness_ != nullptr) witness_->period_passed();
  });
  if (machine == Machine::kManipulator)
    master_.hand = std::make_unique<sim::Hand>(sim::HandParameters{.travel = sim::GripTravel{}});
}

const World* World::captured_ = nullptr;

World::~World() {
  kill_daemon();
  setrlimit(RLIMIT_FSIZE, &file_limit_);  // also when an exception ended the script
  jump_wall_clock(0s);
}

void World::open_devices() {
  // As runtime::open_robot() and runtime::open_haptic() do, with the script's faults in between.
  robot_ = {};
  robot_.emulation = emulation_;
  robot_.manipulator = {emulation_, emulation_->manipulator()};
  robot_.truth = &emulation_->pose();
  robot_.capture = std::make_unique<drivers::ethercat::PcapRing>(
      drivers::ethercat::PcapRing::Options{.interface = "emulated", .frames = 2000, .clock = captured_now});
  captured_ = this;
  hal::EthercatOptions options = config_.robot.ethercat;
  options.tap = robot_.capture.get();
  robot_.robot = hal::make_ethercat_robot(
      [this]() -> std::unique_ptr<drivers::ethercat::Link> {
        return std::make_unique<FaultyLink>(
            std::make_unique<sim::bus::BusLink>(emulation_->wire(), emulation_.get()), wire, random_);
      },
      options, *this, kPeriod);
  if (sabotage_.robot) robot_.robot = sabotage_.robot(std::move(robot_.robot));
  if (!master_.hand) return;
  auto loopback = std::make_unique<hal::LoopbackHapticLink>(
      *master_.hand, kPeriod,
      hal::HapticInfo{.name = "pen", .force_limit_N = config_.haptic.force_limit_N, .senses_rotation = true});
  std::unique_ptr<hal::HapticLink> spoiled = std::make_unique<FaultyPen>(std::move(loopback), pen);
  if (sabotage_.pen) spoiled = sabotage_.pen(std::move(spoiled));
  master_.device =
      std::make_unique<hal::LockstepHapticDevice>(std::move(spoiled), *this, config_.haptic.limits);
}

void World::start_daemon() {
  if (service_) return;
  wire.silent = false;
  start_error_.clear();
  try {
    open_devices();
    service_ = std::make_unique<youbotd::Service>(
        youbotd::ServiceOptions{
            .config_file = config_file_,
            .record_directory = folder_ / "runs",
            .record_format = runtime::RecordingFormat::kCsv,
            .configuration =
                [this](const auto& settings) { return operation::load_config(config_file_, settings); }},
        config_, robot_, master_, *this);
    if (master_.device) master_activation_.emplace(*master_.device);
    service_->require_usable_configuration();
    robot_activation_.emplace(*robot_.robot);
  } catch (const std::exception& error) {
    start_error_ = error.what();
    forget_daemon();
  }
  next_cycle_ = now() + kPeriod;
  until_beat_ = 0;
}

void World::kill_daemon() {
  if (!service_) return;
  wire.silent = true;
  if (witness_ != nullptr) witness_->nothing_runs();
  forget_daemon();
}

void World::end_daemon() noexcept {
  if (service_ && !sabotage_.ignores_its_end) service_->loop().request_stop();
}

std::filesystem::path World::recordings() const {
  if (sabotage_.recordings) sabotage_.recordings(folder() / "runs");
  return folder() / "runs";
}

void World::forget_daemon() noexcept {
  left_.clear();
  robot_activation_.reset();
  master_activation_.reset();
  service_.reset();
  robot_ = {};
  master_.device.reset();
  if (witness_ != nullptr) witness_->nothing_runs();
}

void World::step() {
  if (const nanoseconds rest = next_cycle_ - now(); rest.count() > 0) emulation_->advance(rest);
  if (service_ && now() >= loop_paused_until) {
    if (witness_ != nullptr) witness_->cycle_begins();
    service_->loop().step(now());
    service_->loop().keep();
  } else if (master_.hand) {
    // Its firmware lets go when nothing is exchanged with it.
    master_.hand->advance(Eigen::Vector3d::Zero(), kPeriod);
  }
  // A cycle that took long skips those it missed, as runtime::run_loop() does.
  while (next_cycle_ <= now()) next_cycle_ += kPeriod;
  if (!service_ || answering_) return;  // its thread answers a request, or continues below
  if (service_->loop().finished()) {
    service_->beat();
    forget_daemon();
  } else if (++until_beat_ >= youbotd::kBeat / kPeriod && now() >= beats_paused_until) {
    until_beat_ = 0;
    hear_what_was_left();
    service_->beat();
    if (witness_ != nullptr && !enabled()) witness_->nothing_runs();
  }
}

youbotd::Peer World::peer(std::uint64_t connection, bool may_command) const {
  return {.connection = connection,
          .pid = static_cast<pid_t>(1000 + connection),
          .uid = 1000,
          .name = "client " + std::to_string(connection),
          .may_command = may_command};
}

std::optional<Reply> World::ask(std::uint64_t connection, const std::string& request, bool may_command) {
  if (!service_ || now() < beats_paused_until) return std::nullopt;
  const bool enabling = request == "enable";
  const json before =
      enabling ? json::parse(service_->answer(peer(0, false), "status"))["status"] : json(nullptr);
  answering_ = true;
  std::string text;
  for (const std::string& heard :
       sabotage_.request ? sabotage_.request(request) : std::vector<std::string>{request})
    text = service_->answer(peer(connection, may_command), heard);
  const json answer = json::parse(text);
  answering_ = false;
  Reply reply{answer.at("ok").get<bool>(), answer.value("error", ""), answer.at("status")};
  if (reply.ok && enabling && before["fault"] != "" && before["fault_acknowledged"] == false)
    object("an enable is granted after a fault that was not acknowledged");
  if (reply.ok && enabling && witness_ != nullptr) witness_->enable_granted();
  return reply;
}

void World::leave(std::uint64_t connection, const std::string& request) {
  if (!service_) return;  // nothing listens
  left_.push_back({.at = now(), .connection = connection, .request = request});
}

void World::hear_what_was_left() {
  // After so long the client may have disconnected.
  constexpr auto kStale = 1100ms;
  for (const Left& left : std::exchange(left_, {})) {
    const auto reply = ask(left.connection, left.request);
    if (!reply || !reply->ok || now() - left.at <= kStale) continue;
    const bool acknowledged = left.request == "acknowledge" && reply->status["fault_acknowledged"] == true;
    if (left.request == "enable" || acknowledged)
      object("the daemon grants '" + left.request + "', which waited while it was held up");
  }
}

void World::hang_up(std::uint64_t connection) {
  if (service_) service_->gone(peer(connection, true));
}

}  // namespace faults
