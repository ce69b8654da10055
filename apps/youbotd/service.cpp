#include "apps/youbotd/service.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <exception>
#include <future>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "operation/base_run.h"
#include "operation/hold_source.h"
#include "operation/setting_bounds.h"
#include "operation/teleop_run.h"
#include "operation/tunable.h"
#include "runtime/configuration/plausibility_config.h"
#include "runtime/log.h"
#include "runtime/program/control_socket.h"

namespace youbotd {
namespace {

using nlohmann::json;

/// Share of the following error, for the reference of a velocity.
constexpr double kLeashShare = 2.0 / 3;

/// After a longer wait for a haptic device, the client may no longer expect motion.
constexpr std::chrono::seconds kLongOpening{2};
/// Delay of this thread that neither a disk nor a busy machine causes; requests from that time are stale.
constexpr std::chrono::seconds kLongHoldUp{1};
/// Time after a delay in which waiting requests are read, one of each connection at a time.
constexpr std::chrono::milliseconds kBacklog{500};
/// For all settings together: the status, which contains them, must fit an answer.
constexpr std::size_t kMaxSettings_bytes = runtime::kLongestAnswer / 4;

/// A rejected request, with the reason for the client.
struct Refusal : std::runtime_error {
  using std::runtime_error::runtime_error;
};

constexpr const char* kVelocityMode = "velocity";
constexpr const char* kRos2Mode = "ros2";

constexpr const char* kUnheard =
    "the loop: no orders for 'loop.commander_timeout_s', because this program, or a part of it, did not run; "
    "braked and switched off: end other programs that keep it from running";

/// Shortened to fit an answer.
std::string shortened(std::string text) {
  constexpr std::size_t kMax_bytes = runtime::kLongestAnswer / 8;  // in JSON up to six times as long
  if (text.size() > kMax_bytes) text = text.substr(0, kMax_bytes) + " ...";
  return text;
}

/// Of the recordings run-1, run-2, … in it: one more than the highest, so that their order is that of the
/// runs even after some of them were removed.
int next_number(const std::filesystem::path& directory) {
  constexpr std::string_view kName = "run-";
  constexpr int kLastNumber = 1'000'000;
  int highest = 0;
  std::error_code error;
  for (auto entry = std::filesystem::directory_iterator(directory, error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename();
    int number = 0;
    if (!name.starts_with(kName)) continue;
    const auto [end, bad] = std::from_chars(name.data() + kName.size(), name.data() + name.size(), number);
    if (bad == std::errc() && *end == '\0' && number < kLastNumber) highest = std::max(highest, number);
  }
  return highest + 1;
}

/// Three finite numbers, and nothing else.
control::PlanarVector velocity_of(std::istringstream& words) {
  control::PlanarVector twist_B;
  if (!(words >> twist_B[0] >> twist_B[1] >> twist_B[2]) || !twist_B.allFinite() ||
      (words >> std::ws && !words.eof()))
    throw Refusal("a velocity is three numbers: m/s ahead, m/s to the left, rad/s counter-clockwise");
  return twist_B;
}

}  // namespace

std::vector<std::string> modes_of(bool teleoperated, bool ros2_commands) {
  if (teleoperated) return {"teleoperation"};
  std::vector<std::string> modes{"path", kVelocityMode, "hold"};
  if (ros2_commands) modes.emplace_back(kRos2Mode);
  return modes;
}

Service::Service(const ServiceOptions& options, const operation::Config& config, runtime::OpenedRobot& robot,
                 runtime::OpenedHaptic& master, hal::Clock& clock)
    : options_(options),
      config_(config),
      robot_(robot),
      master_(master),
      clock_(clock),
      loop_(*robot.robot, master.device.get(), robot.capture.get(), config.commander_timeout, options.live),
      mode_(modes_of(config.teleoperated, options.ros2_commands).front()) {}

void Service::require_usable_configuration() {
  (void)make_run(config_, {.config_file = options_.config_file}, nullptr);
}

void Service::attend() {
  const auto now = clock_.now();
  if (attended_ && now - *attended_ > kLongHoldUp) {
    held_up_ = now - *attended_;
    fresh_from_ = now + kBacklog;
    spdlog::warn("the control thread was held up for {:.1f} s: orders that waited this long are ignored",
                 std::chrono::duration<double>(held_up_).count());
  }
  attended_ = now;
}

void Service::require_fresh(std::string_view order) const {
  if (clock_.now() < fresh_from_)
    throw Refusal(
        fmt::format("youbotd was held up for {:.1f} s, and '{}' may have waited as long: send it again",
                    std::chrono::duration<double>(held_up_).count(), order));
}

void Service::beat() {
  attend();
  (void)loop_.take(loop_report_);
  if (master_.link) (void)master_.link->take(link_report_);
  watch_robot();
  watch_checks();
  watch_recording();
  if (run_ && loop_report_.ended == orders_.number) end_run();
  if (commander_ && clock_.now() - commander_heard_ > config_.commander_timeout)
    bring_to_rest(commander_->name + " is silent");
  watch_steering();
  give_orders();
  report_alive();
}

void Service::give_orders() {
  ++orders_.serial;
  loop_.order(orders_);
}

void Service::watch_robot() {
  device_faults_ = robot_.robot->device_faults();
  const FaultLog::News news = fault_log_.update(device_faults_);
  for (const std::string& line : news.faults) spdlog::warn("robot: {}", line);
  for (const std::string& device : news.works_again) spdlog::info("robot: {}: works again", device);
}

void Service::watch_checks() {
  notes_.clear();
  if (run_) notes_ = runtime::notes_on_silent(loop_report_.progress.silent_checks);
  for (const std::string& note : notes_) {
    if (std::find(notes_logged_.begin(), notes_logged_.end(), note) != notes_logged_.end()) continue;
    spdlog::warn("{}", note);
    notes_logged_.push_back(note);
  }
}

void Service::watch_recording() {
  if (!run_) return;
  const bool was_well = !recording_ || recording_->problems.empty();
  recording_ = run_->recording();
  if (recording_ && was_well && !recording_->problems.empty())
    spdlog::warn("recording: {}; the robot continues", recording_->problems.front());
}

void Service::give_orders_and_hear() {
  give_orders();
  const auto until = clock_.now() + std::chrono::seconds(1);
  while (loop_report_.heard != orders_.serial) {
    if (clock_.now() >= until)
      throw Refusal("the loop does not answer: end programs that hold it up, then try again");
    clock_.sleep_until(clock_.now() + kBeat / 10);
    (void)loop_.take(loop_report_);
  }
}

void Service::report_alive() {
  const auto interval = manager_.watchdog_interval();
  if (!interval || clock_.now() - reported_ < *interval || loop_report_.cycles == cycles_reported_) return;
  reported_ = clock_.now();
  cycles_reported_ = loop_report_.cycles;
  manager_.watchdog();
}

void Service::bring_to_rest(const std::string& why) {
  if (!run_ || orders_.stop || orders_.off) return;
  orders_.stop = true;
  give_orders();
  commander_.reset();
  stopped_ = why;
  spdlog::warn("coming to rest: {}", why);
}

void Service::end() {
  ending_ = true;
  bring_to_rest("youbotd ends");
}

void Service::end_run() {
  notes_logged_.clear();
  run_->wrap_up(robot_.capture.get());
  if (!config_.teleoperated) {
    const std::array<double, 3> base_W = run_->progress().base_W;
    X_WB_ = {base_W[0], base_W[1], base_W[2]};
  }
  recording_ = run_->recording();
  const operation::RunSummary& summary = run_->summary();
  fault_ = summary.stop_reason;
  if (fault_.empty() && loop_report_.unheard) fault_ = kUnheard;
  fault_report_ = summary.fault_report.value_or("");
  if (fault_.empty())
    spdlog::info("run {} is over, drives off", orders_.number);
  else
    log_fault();
  if (!fault_report_.empty()) spdlog::error("the last second before it is in {}", fault_report_.string());
  for (const std::string& problem : summary.recording_problems) spdlog::warn("recording: {}", problem);
  if (summary.cycles_lost > 0) spdlog::warn("recording: {} cycles lost", summary.cycles_lost);
  manager_.status(fault_.empty() ? "drives off, waiting for commands" : "stopped by a fault at " + fault_);
  velocity_ = nullptr;
  steered_.reset();
  commander_.reset();
  orders_.run = nullptr;
  run_.reset();
}

void Service::log_fault() {
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
  (void)loop_.take(loop_report_);
  reply["status"] = status();
  // Names come from outside and may not be UTF-8.
  const auto text = [&reply] { return reply.dump(-1, ' ', false, json::error_handler_t::replace); };
  std::string answer = text();
  for (const char* list : {"settings", "fault_robot_report", "robot_trouble"}) {
    if (answer.size() <= runtime::kLongestAnswer) break;
    reply["status"][list] = "too long for an answer";
    answer = text();
  }
  return answer;
}

void Service::obey(const Peer& peer, const std::string& request) {
  attend();
  std::istringstream words(request);
  std::string command;
  words >> command;
  if (commands(peer)) commander_heard_ = clock_.now();
  if (command == "status" || command == "alive") return;
  // Every client may stop the robot.
  if (command == "stop") return bring_to_rest("requested by " + peer.name);
  if (command == "steer" && peer.may_steer) return steer(words);
  if (!peer.may_command)
    throw Refusal(peer.name + " may look and stop; commands are for root, the user of youbotd and its group");
  if (command == "disable") return disable(peer);
  if (commander_ && !commands(peer)) throw Refusal(commander_->name + " commands; stop it first");
  if (command == "acknowledge" || command == "enable") {
    if (std::string more; words >> more) throw Refusal("'" + command + "' has no argument");
    return command == "enable" ? enable(peer) : acknowledge(peer);
  }
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
    if (words.peek() != std::istringstream::traits_type::eof()) throw Refusal("a value is one line");
    return or_log_refusal(peer, [&] { set(peer, key, value); });
  }
  if (command == "unset") {
    std::string key;
    words >> key;
    return or_log_refusal(peer, [&] { unset(peer, key); });
  }
  throw Refusal("there is no command '" + command +
                "'; known: status, acknowledge, enable, stop, disable, mode, set and unset");
}

template <typename Change>
void Service::or_log_refusal(const Peer& peer, const Change& change) {
  try {
    change();
  } catch (const std::exception& error) {
    spdlog::info("{} was refused a setting: {}", peer.name, shortened(error.what()));
    throw;
  }
}

void Service::acknowledge(const Peer& peer) {
  if (!faulted()) return;
  require_fresh("acknowledge");
  fault_acknowledged_ = true;
  spdlog::info("the fault at {} is acknowledged by {}", fault_, peer.name);
  manager_.status("drives off, waiting for commands");
}

void Service::disable(const Peer& peer) {
  orders_.off = run_ != nullptr;
  give_orders();
  if (!run_) return;
  stopped_ = "switched off by " + peer.name;
  spdlog::warn("drives off: requested by {}", peer.name);
}

void Service::enable(const Peer& peer) {
  require_fresh("enable");
  if (ending_) throw Refusal("youbotd ends");
  if (run_)
    throw Refusal(orders_.stop || orders_.off
                      ? "it is still coming to rest: enable again when its phase is off"
                      : "it is enabled already: stop it first to begin another run");
  if (faulted())
    throw Refusal("the last run was stopped by a fault at " + shortened(fault_) +
                  ": when its cause is gone, acknowledge it first (youbotctl acknowledge)");
  const operation::Config config = options_.configuration(settings_);
  const operation::Config file = options_.configuration({});
  require_same_devices(config);
  if (master_.device) open_master_again();  // takes seconds
  file_at_enable_ = file;
  const operation::RunOptions options = next_run();
  operation::VelocitySource* velocity = nullptr;
  run_ = make_run(config, options, &velocity);
  velocity_ = velocity;
  recorded_to_ = options.record_directory.value_or("");
  recording_ = run_->recording();
  orders_ = {.serial = orders_.serial, .number = orders_.number + 1, .run = run_.get()};
  commander_ = peer;
  commander_heard_ = clock_.now();  // earlier messages are outdated
  stopped_.clear();
  fault_.clear();
  fault_acknowledged_ = false;
  fault_report_.clear();
  fault_robot_report_.clear();
  spdlog::info("run {} ({}) enabled by {}", orders_.number, mode_, peer.name);
  for (const std::string& line : operation::arm_lines(config)) spdlog::info("{}", line);
  manager_.status(mode_ + ", enabled by " + peer.name);
  give_orders();
}

/// The file is read for each run, but not what opened the devices.
void Service::require_same_devices(const operation::Config& config) const {
  std::vector<std::string> changed;
  for (const auto& [key, written] : config.opened_once)
    if (written != config_.opened_once.at(key)) changed.push_back(key);
  if (config.teleoperated != config_.teleoperated) changed.emplace_back("teleoperation");
  if (!changed.empty())
    throw Refusal(fmt::format("{} has changed at '{}', which youbotd reads when it starts: restart it",
                              options_.config_file.string(), fmt::join(changed, "' and '")));
}

/// An unplugged device may be back; a lost one, as a Falcon after several missing replies, comes back only by
/// opening it again.
void Service::open_master_again() {
  give_orders_and_hear();  // an older report may describe the device before it was opened
  if (!hal::needs_reopening(loop_report_.master.fault)) return;
  const auto begin = clock_.now();
  orders_.leave_master = true;
  give_orders_and_hear();
  if (!loop_report_.master_left) throw Refusal("the loop has not released the haptic device: enable again");
  std::future<void> opening = std::async(std::launch::async, [this] {
    if (!master_.device->deactivate())
      spdlog::error("{}: nothing confirmed that the force is off: switch the device off",
                    master_.device->info().name);
    master_.device->activate();
  });
  while (opening.wait_for(kBeat) != std::future_status::ready) {
    (void)loop_.take(loop_report_);
    report_alive();
  }
  opening.get();  // or throws, and it stays closed
  orders_.leave_master = false;
  give_orders_and_hear();  // by a loop that is still running
  if (clock_.now() - begin > kLongOpening)
    throw Refusal(master_.device->info().name + " took long to be opened, and is ready now: enable again");
}

operation::RunOptions Service::next_run() const {
  operation::RunOptions run{.config_file = options_.config_file,
                            .record_format = options_.record_format,
                            .experiment = mode_,
                            .virtual_time = !clock_.is_real(),
                            .live = options_.live};
  if (options_.record_directory)
    run.record_directory =
        *options_.record_directory / ("run-" + std::to_string(next_number(*options_.record_directory)));
  for (const auto& [key, value] : settings_) run.settings += key + " = " + value + '\n';
  return run;
}

std::unique_ptr<operation::Run> Service::make_run(const operation::Config& config,
                                                  const operation::RunOptions& options,
                                                  operation::VelocitySource** velocity) {
  if (config_.teleoperated)
    return std::make_unique<operation::TeleopRun>(config, options, *robot_.robot, *master_.device,
                                                  robot_.manipulator.get());
  operation::Config from_here = config;
  from_here.cycle.start = from_here.path.start = X_WB_;
  const Eigen::AlignedBox2d& base_W_m = config.cycle.workspace.base_W_m;
  std::unique_ptr<operation::MotionSource> motion;
  if (mode_ == kVelocityMode || mode_ == kRos2Mode) {
    // Below the following error, which would stop a base that is only held back.
    const operation::VelocitySource::Leash leash{.m = kLeashShare * config.cycle.following_error_m,
                                                 .rad = kLeashShare * config.cycle.following_error_rad};
    // If it was pushed outside, the reference starts at the base, and goes no further out.
    Eigen::AlignedBox2d walls_W_m = base_W_m;
    walls_W_m.extend(Eigen::Vector2d(X_WB_.x_m, X_WB_.y_m));
    const operation::VelocitySource::Wheels wheels{
        .map = control::LinkMap::with_geometry(config.cycle.controller.geometry),
        .speed_limit_rad_per_s = operation::kWheelSpeedShare * config.cycle.wheel_speed_limit_rad_per_s};
    auto source = std::make_unique<operation::VelocitySource>(config.path.limits, wheels, config.cycle.period,
                                                              leash, walls_W_m);
    if (velocity != nullptr) *velocity = source.get();
    motion = std::move(source);
  } else if (mode_ == "hold") {
    motion = std::make_unique<operation::HoldSource>();
  } else {
    if (const auto at = operation::first_outside(from_here.path, base_W_m))
      throw Refusal(fmt::format(
          "from where the base stands, x = {:.2f} m, y = {:.2f} m, the path leads out of [workspace], at x = "
          "{:.2f} m, y = {:.2f} m: drive it back by velocity, or restart youbotd where its walls are to "
          "begin",
          X_WB_.x_m, X_WB_.y_m, at->x_m, at->y_m));
    motion = std::make_unique<operation::PathSource>(from_here.path);
  }
  return std::make_unique<operation::BaseRun>(from_here, options, *robot_.robot, std::move(motion),
                                              robot_.truth);
}

void Service::choose_mode(const std::string& mode) {
  const std::vector<std::string> modes = modes_of(config_.teleoperated, options_.ros2_commands);
  if (std::find(modes.begin(), modes.end(), mode) == modes.end()) {
    std::string names;
    for (const std::string& name : modes) names += (names.empty() ? "" : ", ") + name;
    throw Refusal("there is no mode '" + mode + "'; known: " + names);
  }
  if (run_ && mode != mode_) throw Refusal("the mode cannot change while it is enabled: stop it first");
  mode_ = mode;
}

void Service::require_settable(const std::string& key) const {
  if (!run_) return;
  const std::span<const std::string_view> tunable = run_->tunable();
  if (std::ranges::find(tunable, key) != tunable.end()) return;
  throw Refusal(
      fmt::format("'{}' acts from the next enable on; stop first{}", key,
                  tunable.empty() ? "" : fmt::format(". These act at once: {}", fmt::join(tunable, ", "))));
}

void Service::set(const Peer& peer, const std::string& key, const std::string& value) {
  require_settable(key);
  const std::string table = key.substr(0, key.find('.'));
  if (config_.opened_once.contains(table))
    throw Refusal("'" + table + "' is read once, when youbotd starts: change " +
                  options_.config_file.string());
  std::map<std::string, std::string> settings = settings_;
  settings[key] = value;
  std::size_t size = 0;
  for (const auto& [name, text] : settings) size += name.size() + text.size();
  if (size > kMaxSettings_bytes)
    throw Refusal("the settings would have more than " + std::to_string(kMaxSettings_bytes) +
                  " bytes together: unset some");
  const operation::Config config = options_.configuration(settings);  // throws the errors in it
  if (config.teleoperated != config_.teleoperated)
    throw Refusal("'" + key + "' is for teleoperation, and " + options_.config_file.string() +
                  " has none: start youbotd with one that has");
  if (run_) {
    // The file may have been edited since the enable: of it, only this key counts, and it keeps its ceiling.
    operation::Config tuned = *file_at_enable_;
    operation::copy_tunable(key, config, tuned);
    operation::require_no_weaker(tuned, *file_at_enable_,
                                 options_.config_file.string() + ", as it was at the enable,");
    run_->tune(key, tuned);
  }
  settings_ = std::move(settings);
  spdlog::info("{} set {} = {}", peer.name, key, value);
}

void Service::unset(const Peer& peer, const std::string& key) {
  require_settable(key);
  std::map<std::string, std::string> settings = settings_;
  if (settings.erase(key) == 0) throw Refusal("'" + key + "' is not set: status lists what is");
  if (run_) run_->tune(key, *file_at_enable_);
  // Even if the rest is invalid: enable reports it, and another unset may fix it.
  settings_ = std::move(settings);
  spdlog::info("{} unset {}", peer.name, key);
}

void Service::set_velocity(std::istringstream& words) {
  const control::PlanarVector twist_B = velocity_of(words);
  if (!run_ || velocity_ == nullptr || mode_ != kVelocityMode)
    throw Refusal("it is not enabled in the mode velocity: choose that mode, then enable");
  velocity_->tell(twist_B);
}

void Service::steer(std::istringstream& words) {
  require_fresh("steer");
  const control::PlanarVector twist_B = velocity_of(words);
  if (!run_ || velocity_ == nullptr || mode_ != kRos2Mode)
    throw Refusal("it is not enabled in the mode ros2: a client chooses that mode and enables");
  velocity_->tell(twist_B);
  steered_ = clock_.now();
}

void Service::watch_steering() {
  if (!run_ || !steered_ || clock_.now() - *steered_ <= config_.commander_timeout) return;
  velocity_->tell(control::PlanarVector::Zero());
  steered_.reset();
  spdlog::warn("/cmd_vel of ROS 2 is silent: the base comes to rest, and stays enabled");
}

}  // namespace youbotd
