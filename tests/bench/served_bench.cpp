// served_bench: whether clients of the control socket or of the page delay youbotd's loop. youbotd serves a
// loopback robot at 1 kHz; its own recording contains how late each cycle began and how long it took: with
// the commander only, with viewers of the page, with threads that only compute, and with as many threads of
// hostile clients (support::HostileClients). The compared cases alternate, so that the machine's noise
// affects all. A slow machine causes no failure.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "apps/youbotctl/client.h"
#include "drivers/latency_histogram.h"
#include "runtime/program/control_socket.h"
#include "tests/bench/figures.h"
#include "tests/support/built_paths.h"
#include "tests/support/hostile_clients.h"
#include "tests/support/page_viewers.h"
#include "tests/support/process.h"
#include "tests/support/recording.h"
#include "tests/support/temporary_directory.h"

namespace {

using std::chrono::nanoseconds;
using std::chrono::steady_clock;

constexpr int kRounds = 4;
constexpr std::chrono::seconds kRun{3};
constexpr std::chrono::milliseconds kBetweenRequests{20};
constexpr double kPeriod_s = 0.001;
constexpr int kViewers = 32;

struct Row {
  std::string name;
  drivers::LatencyHistogram step = {};
  drivers::LatencyHistogram wake_up = {};
  drivers::LatencyHistogram answer = {};
  std::size_t cycles = 0;
  std::size_t missed = 0;
  std::uint64_t requests = 0;
  std::uint64_t connections = 0;
};

/// Threads that only compute.
class BusyThreads {
 public:
  explicit BusyThreads(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      threads_.emplace_back([](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
        }
      });
  }

 private:
  std::vector<std::jthread> threads_;
};

void add_recording(Row& row, const std::filesystem::path& path) {
  const support::Recording recording(path);
  const auto microseconds = [](double us) { return nanoseconds(std::llround(1e3 * us)); };
  for (const double us : recording["step_us"]) row.step.add(microseconds(us));
  for (const double us : recording["wake_up_us"]) row.wake_up.add(microseconds(us));
  const std::vector<double>& time_s = recording["time_s"];
  for (std::size_t i = 1; i < time_s.size(); ++i)
    row.missed += static_cast<std::size_t>(std::lround((time_s[i] - time_s[i - 1]) / kPeriod_s)) - 1;
  row.cycles += time_s.size();
}

nlohmann::json ask(youbotctl::Client& client, const std::string& request) {
  nlohmann::json reply = client.ask(request);
  if (reply["ok"] == false) throw std::runtime_error(request + ": " + reply["error"].get<std::string>());
  return reply["status"];
}

/// One run of the robot, with what `disturb` starts beside it. The name of its recording.
std::string run_round(Row& row, const std::filesystem::path& socket,
                      const std::function<void(Row&, const std::function<void()>&)>& disturb) {
  youbotctl::Client commander(socket);
  std::string run = "run-" + std::to_string(ask(commander, "enable")["run"].get<int>());
  disturb(row, [&] {
    double forward_m_per_s = 0.1;
    for (const auto end = steady_clock::now() + kRun; steady_clock::now() < end;) {
      const auto begin = steady_clock::now();
      (void)ask(commander, "set velocity " + std::to_string(forward_m_per_s) + " 0 0");
      row.answer.add(steady_clock::now() - begin);
      forward_m_per_s = -forward_m_per_s;
      std::this_thread::sleep_for(kBetweenRequests);
    }
  });
  (void)ask(commander, "stop");
  while (ask(commander, "status")["enabled"] == true) std::this_thread::sleep_for(kBetweenRequests);
  return run;
}

std::string quantiles(const drivers::LatencyHistogram& histogram) {
  const auto text = [](nanoseconds time) {
    return bench::number_text(std::chrono::duration<double, std::micro>(time).count()) + " µs";
  };
  return text(histogram.quantile(0.5)) + " median, " + text(histogram.quantile(0.99)) + " 99 %, " +
         text(histogram.worst()) + " worst";
}

void add_figures(const Row& row) {
  const std::string how = "served_bench, " + std::to_string(row.cycles) + " cycles";
  bench::add_figure("loop that is served, step: " + row.name, quantiles(row.step), how);
  bench::add_figure("loop that is served, wake-up: " + row.name, quantiles(row.wake_up),
                    how + " and " + std::to_string(row.missed) + " missed");
  bench::add_figure("answer to its commander: " + row.name, quantiles(row.answer),
                    "served_bench, " + std::to_string(row.answer.count()) + " requests" +
                        (row.requests > 0 ? ", beside " + std::to_string(row.requests) + " of others on " +
                                                std::to_string(row.connections) + " connections"
                                          : ""));
}

void print(const Row& row) {
  std::printf("%-34s step    %s\n%-34s wake-up %s; %zu of %zu cycles missed\n%-34s answer  %s\n",
              row.name.c_str(), quantiles(row.step).c_str(), "", quantiles(row.wake_up).c_str(), row.missed,
              row.cycles + row.missed, "", quantiles(row.answer).c_str());
}

int run() {
  const support::TemporaryDirectory folder;
  const std::filesystem::path socket = folder / "control";
  const std::filesystem::path config = folder.write(
      "base.toml", "[path]\nspeed_m_per_s = 0.2\nacceleration_m_per_s2 = 1.0\n[[path.leg]]\nforward_m = 1\n");
  support::Process youbotd({support::program("youbotd"), "--config", config, "--control", socket, "--page",
                            "127.0.0.1:0", "--record-csv", folder / "runs", "--allow-non-rt"});
  if (!youbotd.wait_for("waiting for commands")) throw std::runtime_error("youbotd did not start");
  {
    youbotctl::Client client(socket);
    (void)ask(client, "mode velocity");
  }
  const std::size_t threads = support::HostileClients(folder / "unused").threads();
  using Body = std::function<void()>;
  using Disturb = std::function<void(Row&, const Body&)>;
  const std::string& log = youbotd.output();
  const std::string address = "page: http://127.0.0.1:";
  const auto port = static_cast<std::uint16_t>(std::stoi(log.substr(log.find(address) + address.size())));
  std::array<std::pair<Row, Disturb>, 4> rows{
      {{{"its commander alone"}, [](Row&, const Body& body) { body(); }},
       {{std::to_string(kViewers) + " viewers of the page"},
        [port](Row&, const Body& body) {
          const support::PageViewers viewers(port, kViewers);
          body();
          if (viewers.messages() == 0) throw std::runtime_error("no viewer got anything");
        }},
       {{std::to_string(threads) + " threads compute"},
        [threads](Row&, const Body& body) {
          const BusyThreads busy(threads);
          body();
        }},
       {{std::to_string(threads) + " threads of hostile clients"}, [&socket](Row& row, const Body& body) {
          const support::HostileClients hostile(socket);
          body();
          row.requests += hostile.requests();
          row.connections += hostile.connections();
        }}}};
  for (int round = 0; round < kRounds; ++round)
    for (auto& [row, disturb] : rows)
      add_recording(row, folder / "runs" / run_round(row, socket, disturb) / "base.csv");
  for (const auto& [row, disturb] : rows) {
    print(row);
    add_figures(row);
  }
  return 0;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "served_bench: %s\n", error.what());
    return 1;
  }
}
