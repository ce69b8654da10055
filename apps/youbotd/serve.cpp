#include "apps/youbotd/serve.h"

#include <future>
#include <optional>
#include <span>
#include <stdexcept>
#include <thread>
#include <vector>

#include "apps/youbotd/check.h"
#include "apps/youbotd/page.h"
#include "apps/youbotd/page_requests.h"
#include "apps/youbotd/ros2_topics.h"
#include "operation/teleop_run.h"
#include "runtime/log.h"
#include "runtime/loop.h"
#include "runtime/real_time.h"
#include "runtime/recording/output_directory.h"
#include "runtime/robot_session.h"
#include "runtime/start_thread.h"

namespace youbotd {
namespace {

/// youbotctl and the page ask every 0.1 s: after a run, an answer still reports that youbotd ends.
constexpr std::chrono::milliseconds kLastAnswers{500};

/// Page and ROS 2 topics of a service.
struct Shown {
  Shown(const ServeOptions& options, const operation::Config& config, std::span<const hal::JointInfo> joints,
        const Findings& checks, const hal::Clock& clock)
      : feed(clock) {
    if (options.page) show_page(options, config, joints, checks);
    if (options.ros2) join(*options.ros2, options.service.ros2_commands, config);
  }
  void show_page(const ServeOptions& options, const operation::Config& config,
                 std::span<const hal::JointInfo> joints, const Findings& checks) {
    page.emplace(Page::Options{.where = *options.page,
                               .teleoperated = config.teleoperated,
                               .commanded = true,
                               .modes = modes_of(config.teleoperated, options.service.ros2_commands),
                               .workspace = config.teleoperated ? config.teleoperation.workspace
                                                                : config.cycle.workspace,
                               .geometry = config.cycle.controller.geometry,
                               .checks = checks},
                 feed, requests);
    page->set_joints(joints);
    announce(*page);
    spdlog::info("page with commands: {}", page->command_url());
  }
  void join(std::uint32_t domain, bool commands, const operation::Config& config) {
    topics.emplace(Ros2Topics::Options{.domain = domain,
                                       .teleoperated = config.teleoperated,
                                       .geometry = config.cycle.controller.geometry,
                                       .commanded = true,
                                       .silence = config.commander_timeout},
                   feed, commands ? &requests : nullptr);
    announce_ros2(domain, commands);
  }
  void publish(const nlohmann::json& status) {
    if (page) page->publish_status(status);
    if (topics) topics->publish_status(status);
  }

  operation::LiveFeed feed;
  PageRequests requests;
  std::optional<Page> page;
  std::optional<Ros2Topics> topics;
};

}  // namespace

/// Devices and socket are opened here and the loop runs in its own thread; this one may wait.
void serve(const ServeOptions& options, const std::atomic<bool>& stop) {
  if (options.service.record_directory) runtime::try_output_directory(*options.service.record_directory);
  hal::SteadyClock clock;
  const operation::Config config = options.service.configuration({});
  if (options.service.ros2_commands && config.teleoperated)
    throw std::invalid_argument(
        "--ros2-commands steers a base without a haptic device: not with [teleoperation] or --haptic");
  // Before the robot is opened, which takes the interface.
  Findings checks;
  if (options.page)
    checks = check(config, {.record_directory = options.service.record_directory,
                            .record_format = options.service.record_format,
                            .allow_non_real_time = options.allow_non_real_time});
  runtime::OpenedRobot robot = runtime::open_robot(config.robot, clock, config.cycle.period);
  runtime::OpenedHaptic master;
  if (config.teleoperated) master = operation::open_master(config, clock);
  ServiceOptions service_options = options.service;
  std::optional<Shown> shown;
  if (options.page || options.ros2) {
    shown.emplace(options, config, robot.robot->joints(), checks, clock);
    service_options.live = &shown->feed;
  }
  Service service(service_options, config, robot, master, clock);
  ControlServer server(options.control_socket, service);
  std::optional<runtime::HapticActivation> master_activation;
  if (master.device) {
    master_activation.emplace(*master.device);
    for (const std::string& warning : master.device->info().warnings)
      spdlog::warn("{}: {}", master.device->info().name, warning);
  }
  service.require_usable_configuration();
  const runtime::RobotActivation robot_activation(*robot.robot);

  runtime::LoopStatistics statistics;
  std::atomic<bool> leave{false};
  std::atomic<bool> over{false};
  std::promise<std::vector<std::string>> entered;
  const auto run_cycles = [&](const std::stop_token& left) {  // requested if an exception leaves this
                                                              // function
    runtime::RealTimeThread real_time;
    try {
      entered.set_value(runtime::enter_real_time(real_time, config.real_time, options.allow_non_real_time));
    } catch (...) {
      entered.set_exception(std::current_exception());
      return;
    }
    runtime::run_loop(
        clock, config.cycle.period, service.loop(),
        [&](std::chrono::nanoseconds) {
          // At once, even if the other thread, which ends the program, is held up.
          if (stop.load(std::memory_order_relaxed)) service.loop().rest();
          return leave.load(std::memory_order_relaxed) || left.stop_requested();
        },
        [&](const runtime::CycleTimes& /*times*/) { service.loop().keep(); }, statistics);
    over.store(true, std::memory_order_release);
  };
  std::jthread cycles = runtime::start_thread("the cycles", run_cycles);
  const std::vector<std::string> not_real_time = entered.get_future().get();
  for (const std::string& problem : not_real_time) spdlog::warn("not real-time: {}", problem);
  service.set_not_real_time(not_real_time);
  spdlog::info("{} is open, its drives are off; waiting for commands on {}", config.robot.name,
               options.control_socket.string());
  service.manager().ready("drives off, waiting for commands");
  bool answers = false;  // a run ended with the program, and its commander has not heard that yet
  std::optional<std::chrono::nanoseconds> last_answers;
  while (!over.load(std::memory_order_acquire)) {
    if (stop) {
      answers = answers || service.enabled();
      service.end();
      if (!service.enabled() && !last_answers)
        last_answers = clock.now() + (answers ? kLastAnswers : std::chrono::milliseconds(0));
    }
    if (last_answers && clock.now() >= *last_answers) leave.store(true, std::memory_order_relaxed);
    server.serve(kBeat, shown ? shown->requests.wake_descriptor() : -1);
    if (shown) shown->requests.deliver(service);
    service.beat();
    if (shown) shown->publish(service.status());
    spdlog::default_logger()->flush();  // the return of a log reader is not noticed otherwise
  }
  service.manager().stopping();
  cycles.join();
  service.beat();
  spdlog::info("ended after {} cycles, {} overruns", statistics.cycles, statistics.overruns);
  for (const std::string& line : robot.robot->report()) spdlog::info("robot says: {}", line);
}

}  // namespace youbotd
