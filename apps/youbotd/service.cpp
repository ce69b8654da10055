#include "apps/youbotd/service.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <fstream>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <vector>

#include "apps/common/build_info.h"
#include "apps/common/control_socket.h"
#include "apps/common/loop.h"
#include "apps/common/non_blocking_log.h"
#include "apps/common/output_directory.h"
#include "apps/common/robot_session.h"
#include "apps/common/service_manager.h"
#include "apps/youbotd/base_run.h"
#include "apps/youbotd/control_server.h"
#include "apps/youbotd/served_loop.h"
#include "apps/youbotd/teleop_run.h"
#include "apps/youbotd/trouble_log.h"
#include "apps/youbotd/velocity_source.h"

namespace youbotd {
namespace {

using nlohmann::json;
using std::chrono::steady_clock;

/// How often orders are repeated and news looked at: well within any loop.commander_timeout_s.
constexpr std::chrono::milliseconds kBeat{50};
/// Of the following error, for the reference of a velocity.
constexpr double kLeashShare = 2.0 / 3;
/// Tables that are read when robot and master are opened. The rest is read anew for each run.
constexpr std::array<std::string_view, 8> kOpenedOnce{"robot", "loop",   "geometry",   "ethercat",
                                                      "can",   "haptic", "simulation", "scene"};

/// Who waited longer for a master may not expect motion any more.
constexpr std::chrono::seconds kLongOpening{2};
/// Of all settings together: the status, which holds them, has to fit an answer.
constexpr std::size_t kMaxSettings_bytes = apps::kLongestAnswer / 4;

/// A request that is refused, with the reason for who asked.
struct Refusal : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// So that an answer holds it.
std::string shortened(std::string text) {
  constexpr std::size_t kMax_bytes = apps::kLongestAnswer / 8;  // in JSON up to six times as long
  if (text.size() > kMax_bytes) text = text.substr(0, kMax_bytes) + " ...";
  return text;
}

bool same_geometry(const control::BaseGeometry& a, const control::BaseGeometry& b) {
  return a.wheel_radius_m == b.wheel_radius_m && a.wheelbase_m == b.wheelbase_m && a.track_m == b.track_m;
}

json numbers(const std::array<double, 3>& values) {
  return std::isfinite(values[0]) ? json(values) : json(nullptr);
}

class Service final : public ControlServer::Listener {
 public:
  explicit Service(const ServiceOptions& options)
      : options_(options),
        config_(options.configuration({})),
        robot_(apps::open_robot(config_.robot, clock_, config_.cycle.period)),
        mode_(config_.teleoperated ? "teleoperation" : "path") {
    if (config_.teleoperated) master_ = open_master(config_.haptic, clock_, config_.cycle.period);
  }

  void serve(const std::atomic<bool>& stop);

  std::string answer(const Peer& peer, const std::string& request) override;
  void gone(const Peer& peer) override;
  bool commands(const Peer& peer) const override {
    return commander_ && commander_->connection == peer.connection;
  }

 private:
  // What is asked.
  void obey(const Peer& peer, const std::string& request);
  void enable(const Peer& peer);
  void choose_mode(const std::string& mode);
  void set(const Peer& peer, const std::string& key, const std::string& value);
  void unset(const Peer& peer, const std::string& key);
  void set_velocity(std::istringstream& words);
  std::string robot_state() const;
  json status() const;

  void require_same_devices(const Config& config) const;
  /// `velocity`, unless null, is where to tell one, in the mode that follows it.
  std::unique_ptr<Run> make_run(const Config& config, const RunOptions& options, VelocitySource** velocity);
  RunOptions next_run() const;
  void record_settings(const std::filesystem::path& directory) const;
  void open_master_again();
  void give_orders();
  /// Gives the orders and waits for a cycle that followed them, and for what it tells.
  void give_orders_and_hear();
  /// The orders again, and what became of them.
  void beat();
  /// Tells the log what of the robot is lost, and what is back.
  void watch_robot();
  /// The same of the recording, once.
  void watch_recording();
  void end_run();
  void tell_fault();
  /// To the service manager: alive, as long as the cycles go on.
  void report_alive();
  void bring_to_rest(const std::string& why);

  ServiceOptions options_;
  apps::NonBlockingLog log_;
  apps::ServiceManager manager_;
  hal::SteadyClock clock_;
  Config config_;
  apps::OpenedRobot robot_;
  apps::OpenedHaptic master_;
  std::unique_ptr<ServedLoop> loop_;

  std::string mode_;
  std::map<std::string, std::string> settings_;
  std::vector<std::string> not_real_time_;
  Orders orders_;
  Told told_;
  std::unique_ptr<Run> run_;            // the one under way
  VelocitySource* velocity_ = nullptr;  // of that run, in mode velocity
  std::optional<Peer> commander_;       // while it is
  std::string fault_;                   // that ended the last run
  std::filesystem::path fault_report_;
  std::filesystem::path recorded_to_;            // by the run under way or the last one; empty: nothing is
  std::optional<RecordingState> recording_;      // of it
  std::vector<std::string> fault_robot_report_;  // what the robot said then, of all since it was activated
  std::vector<std::string> trouble_;             // hal::Robot::trouble()
  TroubleLog trouble_log_;
  std::uint64_t cycles_reported_ = 0;
  steady_clock::time_point reported_{};
};

/// Robot, master and socket are opened here and the loop runs in a thread of its own; this one may wait.
void Service::serve(const std::atomic<bool>& stop) {
  loop_ = std::make_unique<ServedLoop>(*robot_.robot, master_.device.get(), robot_.capture.get(),
                                       config_.commander_timeout);
  ControlServer server(options_.control_socket, *this);
  std::optional<apps::HapticActivation> master_activation;
  if (master_.device) master_activation.emplace(*master_.device);
  if (master_.device)
    for (const std::string& warning : master_.device->info().warnings)
      spdlog::warn("{}: {}", master_.device->info().name, warning);
  // What cannot run is told now and not when somebody enables it.
  (void)make_run(config_, {.config_file = options_.config_file}, nullptr);
  const apps::RobotActivation robot_activation(*robot_.robot);

  apps::LoopStatistics statistics;
  std::atomic<bool> over{false};
  std::promise<std::vector<std::string>> entered;
  std::jthread cycles([&](const std::stop_token& left) {  // by an exception, below
    apps::RealTimeThread real_time;
    try {
      entered.set_value(apps::enter_real_time(real_time, config_.real_time, options_.allow_non_real_time));
    } catch (...) {
      entered.set_exception(std::current_exception());
      return;
    }
    apps::run_loop(
        clock_, config_.cycle.period, *loop_,
        [&](std::chrono::nanoseconds) {
          return stop.load(std::memory_order_relaxed) || left.stop_requested();
        },
        [&](const CycleTimes& /*times*/) { loop_->keep(); }, statistics);
    over.store(true, std::memory_order_release);
  });
  not_real_time_ = entered.get_future().get();
  for (const std::string& problem : not_real_time_) spdlog::warn("not real-time: {}", problem);
  spdlog::info("{} is open, its drives are off; waiting for commands on {}", config_.robot.name,
               options_.control_socket.string());
  manager_.ready("drives off, waiting for commands");
  while (!over.load(std::memory_order_acquire)) {
    server.serve(kBeat);
    beat();
    report_alive();
  }
  manager_.stopping();
  cycles.join();
  beat();
  spdlog::info("ended after {} cycles, {} overruns", statistics.cycles, statistics.overruns);
  for (const std::string& line : robot_.robot->report()) spdlog::info("robot says: {}", line);
}

void Service::beat() {
  (void)loop_->take(told_);
  watch_robot();
  watch_recording();
  if (run_ && told_.ended == orders_.number) end_run();
  if (commander_ && steady_clock::now() - commander_->heard > config_.commander_timeout)
    bring_to_rest(commander_->name + " is silent");
  give_orders();
  log_.flush();
}

void Service::give_orders() {
  ++orders_.serial;
  loop_->order(orders_);
}

void Service::watch_robot() {
  trouble_ = robot_.robot->trouble();
  const TroubleLog::News news = trouble_log_.update(trouble_);
  for (const std::string& line : news.trouble) spdlog::warn("robot: {}", line);
  for (const std::string& device : news.works_again) spdlog::info("robot: {}: works again", device);
}

void Service::watch_recording() {
  if (!run_) return;
  const bool was_well = !recording_ || recording_->problems.empty();
  recording_ = run_->recording();
  if (recording_ && was_well && !recording_->problems.empty())
    spdlog::warn("recording: {}; the robot goes on", recording_->problems.front());
}

void Service::give_orders_and_hear() {
  give_orders();
  const auto until = steady_clock::now() + std::chrono::seconds(1);
  while (told_.heard != orders_.serial) {
    if (steady_clock::now() >= until) throw Refusal("the loop does not answer");
    std::this_thread::sleep_for(kBeat / 10);
    (void)loop_->take(told_);
  }
}

void Service::report_alive() {
  const auto interval = manager_.watchdog_interval();
  if (!interval || steady_clock::now() - reported_ < *interval || told_.cycles == cycles_reported_) return;
  reported_ = steady_clock::now();
  cycles_reported_ = told_.cycles;
  manager_.watchdog();
}

void Service::bring_to_rest(const std::string& why) {
  if (!run_ || orders_.stop || orders_.off) return;
  orders_.stop = true;
  give_orders();
  commander_.reset();
  spdlog::warn("coming to rest: {}", why);
}

void Service::end_run() {
  run_->wrap_up(robot_.capture.get());
  recording_ = run_->recording();
  const RunSummary& summary = run_->summary();
  fault_ = summary.stop_reason;
  fault_report_ = summary.fault_report.value_or("");
  if (fault_.empty())
    spdlog::info("run {} is over, drives off", orders_.number);
  else
    tell_fault();
  if (!fault_report_.empty()) spdlog::error("the last second before it is in {}", fault_report_.string());
  for (const std::string& problem : summary.recording_problems) spdlog::warn("recording: {}", problem);
  if (summary.cycles_lost > 0) spdlog::warn("recording: {} cycles lost", summary.cycles_lost);
  manager_.status(fault_.empty() ? "drives off, waiting for commands" : "stopped by a fault at " + fault_);
  velocity_ = nullptr;
  commander_.reset();
  orders_.run = nullptr;
  run_.reset();
}

void Service::tell_fault() {
  spdlog::error("run {} was stopped by a fault at {}", orders_.number, fault_);
  fault_robot_report_ = robot_.robot->report();
  for (const std::string& line : fault_robot_report_) spdlog::error("robot says: {}", line);
}

void Service::gone(const Peer& peer) {
  if (commands(peer)) bring_to_rest(peer.name + " is gone");
}

std::string Service::answer(const Peer& peer, const std::string& request) {
  json reply;
  try {
    obey(peer, request);
    reply["ok"] = true;
  } catch (const std::exception& error) {
    reply["ok"] = false;
    reply["error"] = shortened(error.what());
  }
  (void)loop_->take(told_);
  reply["status"] = status();
  // Names come from outside and may be anything but UTF-8.
  const auto text = [&reply] { return reply.dump(-1, ' ', false, json::error_handler_t::replace); };
  std::string answer = text();
  for (const char* list : {"settings", "fault_robot_report", "robot_trouble"}) {
    if (answer.size() <= apps::kLongestAnswer) break;
    reply["status"][list] = "too long for an answer";
    answer = text();
  }
  return answer;
}

void Service::obey(const Peer& peer, const std::string& request) {
  std::istringstream words(request);
  std::string command;
  words >> command;
  if (commands(peer)) commander_->heard = peer.heard;
  if (command == "status" || command == "alive") return;
  // Whoever sees that it must not go on may say so.
  if (command == "stop") return bring_to_rest("requested by " + peer.name);
  if (!peer.may_command)
    throw Refusal(peer.name + " may look and stop; commands are for root, the user of youbotd and its group");
  if (command == "disable") {
    orders_.off = run_ != nullptr;
    give_orders();
    if (run_) spdlog::warn("drives off: requested by {}", peer.name);
    return;
  }
  if (commander_ && !commands(peer)) throw Refusal(commander_->name + " commands; stop it first");
  if (command == "enable") return enable(peer);
  if (command == "mode") {
    std::string mode;
    words >> mode;
    return choose_mode(mode);
  }
  if (command == "set") {
    std::string key;
    std::string value;
    words >> key;
    if (key == "velocity") return set_velocity(words);
    std::getline(words >> std::ws, value);
    return set(peer, key, value);
  }
  if (command == "unset") {
    std::string key;
    words >> key;
    return unset(peer, key);
  }
  throw Refusal("there is no command '" + command +
                "', but status, enable, stop, disable, mode, set and unset");
}

void Service::enable(const Peer& peer) {
  if (run_)
    throw Refusal(orders_.stop || orders_.off ? "it is still coming to rest" : "it is enabled already");
  const Config config = options_.configuration(settings_);
  require_same_devices(config);
  if (master_.device) open_master_again();
  const RunOptions options = next_run();
  VelocitySource* velocity = nullptr;
  run_ = make_run(config, options, &velocity);
  velocity_ = velocity;
  if (options.record_directory) record_settings(*options.record_directory);
  recorded_to_ = options.record_directory.value_or("");
  recording_ = run_->recording();
  orders_ = {.serial = orders_.serial, .number = orders_.number + 1, .run = run_.get()};
  commander_ = peer;
  commander_->heard = steady_clock::now();  // what came before this took its time
  fault_.clear();
  fault_report_.clear();
  fault_robot_report_.clear();
  spdlog::info("run {} ({}) enabled by {}", orders_.number, mode_, peer.name);
  manager_.status(mode_ + ", enabled by " + peer.name);
  give_orders();
}

/// The file is read anew for each run; what it says of the loop and of what is open has to be as it was.
void Service::require_same_devices(const Config& config) const {
  const bool same =
      config.cycle.period == config_.cycle.period && config.commander_timeout == config_.commander_timeout &&
      same_geometry(config.cycle.controller.geometry, config_.cycle.controller.geometry) &&
      config.robot.name == config_.robot.name && config.robot.ethercat.kind == config_.robot.ethercat.kind &&
      config.haptic.name == config_.haptic.name &&
      config.haptic.limits.slew_N_per_s == config_.haptic.limits.slew_N_per_s &&
      config.teleoperated == config_.teleoperated;
  if (!same)
    throw Refusal(
        options_.config_file.string() +
        " says something else of the loop, the geometry, the robot or the master by now: restart youbotd");
}

/// One that was unplugged is plugged in again, perhaps; and one that was lost for its driver, as a Falcon is
/// after some replies that did not come, is there again only when it is opened anew.
void Service::open_master_again() {
  give_orders_and_hear();  // what was told before may be of the master as it was before it was opened
  if (told_.master.fault != hal::HapticFault::kUnplugged &&
      told_.master.fault != hal::HapticFault::kDeviceFault)
    return;
  const auto begin = steady_clock::now();
  orders_.leave_master = true;
  give_orders_and_hear();
  if (!told_.master_left) throw Refusal("the loop has not left the master");
  std::future<void> opening = std::async(std::launch::async, [this] {
    if (!master_.device->deactivate())
      spdlog::error("{}: nothing confirmed that the force is off: switch the device off",
                    master_.device->info().name);
    master_.device->activate();
  });
  while (opening.wait_for(kBeat) != std::future_status::ready) {
    (void)loop_->take(told_);
    report_alive();
  }
  opening.get();  // or throws, and it stays left
  orders_.leave_master = false;
  give_orders_and_hear();  // by a loop that did not end meanwhile
  if (steady_clock::now() - begin > kLongOpening)
    throw Refusal(master_.device->info().name + " took long to be opened, and is ready now: enable again");
}

RunOptions Service::next_run() const {
  RunOptions run{.config_file = options_.config_file, .experiment = mode_};
  for (int number = 1; options_.record_directory; ++number) {
    run.record_directory = *options_.record_directory / ("run-" + std::to_string(number));
    if (!std::filesystem::exists(*run.record_directory)) break;
  }
  return run;
}

/// Beside the configuration, which they stood over.
void Service::record_settings(const std::filesystem::path& directory) const {
  if (settings_.empty()) return;
  const std::filesystem::path path = directory / "settings.toml";
  std::ofstream file(path);
  for (const auto& [key, value] : settings_) file << key << " = " << value << '\n';
  file.close();
  if (!file) spdlog::warn("recording: {} could not be written", path.string());
}

std::unique_ptr<Run> Service::make_run(const Config& config, const RunOptions& options,
                                       VelocitySource** velocity) {
  if (config_.teleoperated)
    return std::make_unique<TeleopRun>(config, options, *robot_.robot, *master_.device,
                                       robot_.manipulator.get());
  std::unique_ptr<MotionSource> motion;
  if (mode_ == "velocity") {
    // Short of the following error, which would stop a base that is only held back.
    const VelocitySource::Leash leash{.m = kLeashShare * config.cycle.following_error_m,
                                      .rad = kLeashShare * config.cycle.following_error_rad};
    auto source = std::make_unique<VelocitySource>(config.path.limits, config.cycle.period, leash,
                                                   config.cycle.workspace.base_W_m);
    if (velocity != nullptr) *velocity = source.get();
    motion = std::move(source);
  } else {
    motion = std::make_unique<PathSource>(config.path);
  }
  return std::make_unique<BaseRun>(config, options, *robot_.robot, std::move(motion), robot_.truth);
}

void Service::choose_mode(const std::string& mode) {
  const std::vector<std::string> modes = config_.teleoperated ? std::vector<std::string>{"teleoperation"}
                                                              : std::vector<std::string>{"path", "velocity"};
  if (std::find(modes.begin(), modes.end(), mode) == modes.end()) {
    std::string names;
    for (const std::string& name : modes) names += (names.empty() ? "" : ", ") + name;
    throw Refusal("there is no mode '" + mode + "', but " + names);
  }
  if (run_ && mode != mode_) throw Refusal("the mode cannot change while it is enabled");
  mode_ = mode;
}

void Service::set(const Peer& peer, const std::string& key, const std::string& value) {
  if (run_) throw Refusal("settings act from the next enable on; stop first");
  const std::string table = key.substr(0, key.find('.'));
  if (std::find(kOpenedOnce.begin(), kOpenedOnce.end(), table) != kOpenedOnce.end())
    throw Refusal("'" + table + "' is read once, when youbotd starts: change " +
                  options_.config_file.string());
  std::map<std::string, std::string> settings = settings_;
  settings[key] = value;
  std::size_t size = 0;
  for (const auto& [name, text] : settings) size += name.size() + text.size();
  if (size > kMaxSettings_bytes)
    throw Refusal("the settings would have more than " + std::to_string(kMaxSettings_bytes) +
                  " bytes together: unset some");
  const Config config = options_.configuration(settings);  // throws what is wrong with it
  if (config.teleoperated != config_.teleoperated)
    throw Refusal("'" + key + "' is for teleoperation, and " + options_.config_file.string() + " has none");
  settings_ = std::move(settings);
  spdlog::info("{} set {} = {}", peer.name, key, value);
}

void Service::unset(const Peer& peer, const std::string& key) {
  if (run_) throw Refusal("settings act from the next enable on; stop first");
  std::map<std::string, std::string> settings = settings_;
  if (settings.erase(key) == 0) throw Refusal("'" + key + "' is not set");
  // Even when what is left cannot be used: enable says so, and another unset may mend it.
  settings_ = std::move(settings);
  spdlog::info("{} unset {}", peer.name, key);
}

void Service::set_velocity(std::istringstream& words) {
  control::PlanarVector twist_B;
  if (!(words >> twist_B[0] >> twist_B[1] >> twist_B[2]) || !twist_B.allFinite() ||
      (words >> std::ws && !words.eof()))
    throw Refusal("a velocity is three numbers: m/s ahead, m/s to the left, rad/s counter-clockwise");
  if (!run_ || velocity_ == nullptr) throw Refusal("it is not enabled in the mode velocity");
  velocity_->tell(twist_B);
}

/// While there is no run: "wheel-2: some devices on the bus did not answer".
std::string Service::robot_state() const {
  const hal::CycleStatus& robot = told_.robot;
  if (robot.ok()) return "ready";
  const std::string joint =
      robot.joint >= 0 ? robot_.robot->joints()[static_cast<std::size_t>(robot.joint)].name + ": " : "";
  return joint + robot_.robot->explain(robot);
}

json bus_json(const std::optional<hal::BusLosses>& losses) {
  if (!losses) return nullptr;
  constexpr std::array<const char*, 3> kLevels{"ok", "warning", "fault"};
  return {{"level", kLevels[static_cast<std::size_t>(losses->level)]},
          {"bridged_of_1000_cycles", losses->cycles},
          {"lost", losses->lost},
          {"incomplete", losses->incomplete},
          {"late", losses->late},
          {"damaged", losses->damaged}};
}

json recording_json(const std::filesystem::path& directory, const std::optional<RecordingState>& recording) {
  if (!recording) return nullptr;
  return {{"directory", directory.string()},
          {"state", recording->problems.empty() ? "ok" : "failing"},
          {"cycles_lost", recording->cycles_lost},
          {"problems", recording->problems}};
}

json Service::status() const {
  const Progress& now = told_.progress;
  json status{{"format", "youbotd-status/1"},
              {"version", apps::build_version()},
              {"robot", config_.robot.name},
              {"mode", mode_},
              {"run", orders_.number},
              {"enabled", run_ != nullptr},
              {"phase", run_             ? now.phase
                        : fault_.empty() ? "off"
                                         : "faulted"},
              {"cycles", told_.cycles},
              {"real_time", not_real_time_.empty()},
              {"settings", settings_}};
  status["commander"] = commander_ ? json(commander_->name) : json(nullptr);
  status["fault"] = fault_;
  status["fault_report"] = fault_report_.string();
  status["fault_robot_report"] = fault_robot_report_;
  status["robot_trouble"] = trouble_;
  status["bus"] = bus_json(robot_.robot->losses());
  status["recording"] = recording_json(recorded_to_, recording_);
  if (run_) {
    status["time_s"] = std::chrono::duration<double>(now.time).count();
    status["base_W"] = numbers(now.base_W);
    status["tip_p_WT_m"] = numbers(now.tip_p_WT_m);
    status["force_H_N"] = numbers(now.force_H_N);
  } else {
    status["robot_state"] = robot_state();
  }
  if (master_.device) {
    status["master"] = master_.device->info().name;
    if (!run_) status["master_state"] = told_.master.ok() ? "ready" : master_.device->describe(told_.master);
  }
  return status;
}

}  // namespace

void run_service(const ServiceOptions& options, const std::atomic<bool>& stop) {
  if (options.record_directory) apps::try_output_directory(*options.record_directory);
  Service service(options);
  service.serve(stop);
}

}  // namespace youbotd
