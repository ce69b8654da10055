// youbotctl: commands a running youbotd, and converts its recordings.
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "apps/youbotctl/client.h"
#include "apps/youbotctl/export_lerobot.h"
#include "apps/youbotctl/files.h"
#include "drivers/uninterrupted.h"
#include "hal/setup_error.h"
#include "runtime/log.h"
#include "runtime/program/control_socket.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/printable.h"
#include "runtime/program/run_app.h"
#include "runtime/program/stop_on_signals.h"

namespace {

using nlohmann::json;
using youbotctl::Client;

/// Two periods are shorter than the minimum loop.commander_timeout_s, 0.3 s.
constexpr int kBeat_ms = 100;

struct Arguments {
  std::string socket = runtime::kControlSocket;
  bool as_json = false;
  bool quiet = false;
  std::string mode;
  std::string key;
  std::string in;
  std::string out;
  std::vector<std::filesystem::path> paths;
  youbotctl::LerobotOptions lerobot;
  std::string joint;
  std::string columns;
};

std::string text(const json& status, const char* key) {
  const auto found = status.find(key);
  return found != status.end() && found->is_string() ? found->get<std::string>() : "";
}

std::vector<std::string> texts(const json& status, const char* key) {
  const auto found = status.find(key);
  std::vector<std::string> all;
  if (found != status.end() && found->is_array())
    for (const json& one : *found)
      if (one.is_string()) all.push_back(one.get<std::string>());
  return all;
}

/// A line for each item.
void print(const json& status) {
  const auto line = [](const char* name, const std::string& what) {
    if (!what.empty()) std::printf("%-10s %s\n", name, runtime::printable_entry(what).c_str());
  };
  const auto numbers = [&](const char* name, const char* key, const char* unit) {
    const auto found = status.find(key);
    if (found == status.end() || !found->is_array()) return;
    std::string all;
    for (const json& number : *found) {
      std::array<char, 32> one{};
      std::snprintf(one.data(), one.size(), "%.3f ", number.get<double>());
      all += one.data();
    }
    line(name, all + unit);
  };
  line("youbotd", text(status, "version"));
  line("mode", text(status, "mode"));
  line("phase", text(status, "phase"));
  line("commander", text(status, "commander"));
  line("robot",
       text(status, "robot") + (status.contains("robot_state") ? ": " + text(status, "robot_state") : ""));
  for (const char* list : {"robot_trouble", "notes"})
    for (const std::string& text : texts(status, list)) line("", text);
  if (status.contains("bus") && status["bus"].is_object())
    line("bus", text(status["bus"], "level") + ", " +
                    status["bus"].value("bridged_of_1000_cycles", json()).dump() +
                    " of the last 1000 cycles without a whole answer");
  if (status.contains("recording") && status["recording"].is_object()) {
    const json& recording = status["recording"];
    line("recording", text(recording, "state") + ", " + text(recording, "directory"));
    for (const std::string& problem : texts(recording, "problems")) line("", problem);
  }
  if (status.contains("master"))
    line("device", text(status, "master") +
                       (status.contains("master_state") ? ": " + text(status, "master_state") : ""));
  if (status.contains("link")) {
    const json& link = status["link"];
    const bool connected = link["connected"] == true;
    std::array<char, 80> quality{};
    if (connected)
      std::snprintf(quality.data(), quality.size(), ", round trip %.0f ms, %.1f %% lost here, %.1f %% there",
                    1e3 * link.value("round_trip_s", 0.0), 100 * link.value("lost", 0.0),
                    100 * link.value("lost_there", 0.0));
    line("link", (connected ? "connected" : "not connected") + std::string(quality.data()));
  }
  numbers("base", "base_W", "m, m, rad");
  numbers("end effector", "tip_p_WT_m", "m");
  numbers("hand", "force_H_N", "N");
  if (status.contains("settings"))
    for (const auto& [key, value] : status["settings"].items())
      line("set", key + " = " + (value.is_string() ? value.get<std::string>() : value.dump()));
  if (status.contains("real_time") && status["real_time"] == false) line("", "NOT REAL-TIME");
  line("stopped", text(status, "stopped"));
  line("fault", text(status, "fault"));
  for (const std::string& said : texts(status, "fault_robot_report")) line("", said);
  line("report", text(status, "fault_report"));
}

/// Prints a refusal; everything else as configured by the options.
int tell(const json& reply, const Arguments& arguments, bool with_status) {
  if (reply["ok"] == false) {
    spdlog::error("{}", text(reply, "error"));
    return runtime::kExitUsage;
  }
  if (arguments.as_json)
    std::printf("%s\n", reply["status"].dump(2).c_str());
  else if (with_status)
    print(reply["status"]);
  return runtime::kExitOk;
}

int ask(const Arguments& arguments, const std::string& request, bool with_status = false) {
  Client client(arguments.socket);
  return tell(client.ask(request), arguments, with_status);
}

/// A line from standard input, if there is one before the next beat.
class Input {
 public:
  bool take(std::string& line) {
    if (!ended_) listen();
    const std::size_t end = pending_.find('\n');
    if (end == pending_.npos) {
      // Dropped on arrival, so that an endless line takes no memory.
      too_long_ = too_long_ || pending_.size() > runtime::kLongestRequest;
      if (too_long_) pending_.clear();
      return false;
    }
    line = pending_.substr(0, end);
    pending_.erase(0, end + 1);
    if (std::exchange(too_long_, false) || line.size() > runtime::kLongestRequest) {
      spdlog::error("a line of more than {} bytes is ignored", runtime::kLongestRequest);
      line.clear();
    }
    return true;
  }
  bool ended() const { return ended_; }

 private:
  void listen() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    // A complete line needs no waiting.
    const int ready = poll(&input, 1, pending_.find('\n') == pending_.npos ? kBeat_ms : 0);
    // The robot must not continue for a client that cannot be heard.
    if (ready < 0 && errno != EINTR)
      throw hal::SetupError("standard input, /dev/stdin",
                            "wait for a line: " + std::generic_category().message(errno),
                            "the robot comes to rest");
    if (ready <= 0) return;
    std::array<char, 1024> text{};
    const ssize_t size = drivers::uninterrupted([&] { return read(STDIN_FILENO, text.data(), text.size()); });
    ended_ = size <= 0;
    if (ended_ && !pending_.empty()) pending_ += '\n';  // the last line may lack its end
    if (size > 0) pending_.append(text.data(), static_cast<std::size_t>(size));
  }
  std::string pending_;
  bool too_long_ = false;
  bool ended_ = false;
};

/// Enables and stays connected: the robot comes to rest when this ends.
int enable(const Arguments& arguments) {
  runtime::stop_on_signals();
  Client client(arguments.socket);
  json reply = client.ask("enable");
  if (reply["ok"] == false) return tell(reply, arguments, false);
  if (!arguments.quiet) std::fprintf(stderr, "enabled: Ctrl-C stops; commands are read, one a line\n");
  const json run = reply["status"]["run"];
  const auto goes_on = [&] { return reply["status"]["run"] == run && reply["status"]["enabled"] == true; };
  Input input;
  std::string phase;
  bool stopping = false;
  while (goes_on()) {
    if (const std::string now = text(reply["status"], "phase"); now != phase && now != "off") {
      if (!arguments.quiet) std::printf("%s\n", now.c_str());
      std::fflush(stdout);
      phase = now;
    }
    std::string line;
    const bool has_line = input.take(line);
    // No further velocity can arrive.
    const bool abandoned = !has_line && input.ended() && text(reply["status"], "mode") == "velocity";
    if (!stopping && (runtime::stop_requested || abandoned)) {
      stopping = true;
      line = "stop";
    } else if (!has_line && input.ended()) {
      usleep(1000U * kBeat_ms);
    }
    reply = client.ask(line.empty() ? "alive" : line);
    if (reply["ok"] == false) spdlog::error("{}", text(reply, "error"));
  }
  if (reply["status"]["run"] != run) {
    spdlog::error("the run has ended, and another client has enabled the next one");
    return runtime::kExitUsage;
  }
  if (const std::string fault = text(reply["status"], "fault"); !fault.empty()) {
    spdlog::error("stopped by a fault at {}", fault);
    for (const std::string& said : texts(reply["status"], "fault_robot_report"))
      spdlog::error("robot says: {}", said);
    return runtime::kExitFault;
  }
  const std::string stopped = stopping ? "" : text(reply["status"], "stopped");
  if (!arguments.quiet)
    std::printf("off%s%s\n", stopped.empty() ? "" : ": ", runtime::printable_entry(stopped).c_str());
  return runtime::kExitOk;
}

}  // namespace

// NOLINTNEXTLINE(bugprone-exception-escape): out of memory before the first message may end the process.
int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Commands a running youbotd (youbotd --control) and converts its recordings. ENABLE MOVES A MACHINE.",
      "youbotctl");
  app.footer(
      "Exit codes: 0 done, 2 usage, or youbotd refused, 3 no youbotd is running, or a file cannot be read or "
      "written, 4 the run was stopped by a fault.");
  app.require_subcommand(1);
  app.add_option("--socket", arguments.socket, "path of youbotd's control socket, its --control")
      ->capture_default_str();
  app.add_flag("--quiet", arguments.quiet, "print problems only");
  std::function<int()> chosen;
  const auto command = [&](const char* name, const char* what, std::function<int()> body) {
    CLI::App* sub = app.add_subcommand(name, what);
    sub->callback([&chosen, body = std::move(body)] { chosen = body; });
    return sub;
  };
  command("status", "print the status", [&] {
    return ask(arguments, "status", !arguments.quiet);
  })->add_flag("--json", arguments.as_json, "print JSON, for other programs");
  command("enable",
          "start the robot and stay connected: the robot comes to rest when this program ends, for any "
          "reason. Ctrl-C stops. Reads commands from standard input, one per line",
          [&] { return enable(arguments); });
  command(
      "acknowledge",
      "acknowledge the fault that stopped the last run, once its cause is gone; until then enable is refused",
      [&] { return ask(arguments, "acknowledge"); });
  command("stop",
          "brake to rest, drives off; teleoperation lowers the arm first, otherwise a raised arm FALLS",
          [&] { return ask(arguments, "stop"); });
  command("disable", "drives off at once: an arm FALLS", [&] { return ask(arguments, "disable"); });
  command("mode", "select what enable starts", [&] { return ask(arguments, "mode " + arguments.mode); })
      ->add_option(
          "name", arguments.mode,
          "path, velocity or hold, and ros2 with --ros2-commands; teleoperation if a haptic device is in "
          "command")
      ->required();
  CLI::App* set = nullptr;
  set =
      command("set",
              "set a configuration key for the next enable, as in: set limits.force_N 4; during a "
              "teleoperation, on the standard input of `enable`, stiffness, scales, rate speed and feedback "
              "at once. In velocity mode, "
              "on the standard input of `enable`: set velocity AHEAD LEFT TURN, in m/s, m/s and rad/s "
              "counter-clockwise, within the limits of [path]",
              [&] {
                if (set->remaining().empty()) throw std::invalid_argument("set: a value is missing");
                std::string request = "set " + arguments.key;
                for (const std::string& value : set->remaining()) request += " " + value;
                return ask(arguments, request);
              });
  command("unset", "undo `set` for one key: the file's value applies when `set` would",
          [&] { return ask(arguments, "unset " + arguments.key); })
      ->add_option("key", arguments.key, "dotted name, such as limits.force_N")
      ->required();
  set->add_option("key", arguments.key, "dotted name, such as limits.force_N; or velocity")->required();
  // Without an option for it: the library would split a TOML array.
  set->prefix_command();
  set->footer("The value follows the key, written as in the file.");
  const auto file_command = [&](const char* name, const char* what, std::function<int()> body) {
    CLI::App* sub = command(name, what, std::move(body));
    sub->add_option("in", arguments.in, "file to read")->required();
    sub->add_option("out", arguments.out, "file to create; an existing one is not replaced")->required();
    return sub;
  };
  CLI::App* const converting = file_command(
      "convert",
      "convert a recording from CSV to MCAP or from MCAP to CSV, by the extensions .csv and .mcap; or a "
      "table of another program, by --columns, or a log of bam (.json) to either. Needs no youbotd",
      [&] {
        const bool is_table =
            !arguments.columns.empty() || std::filesystem::path(arguments.in).extension() == ".json";
        if (is_table && !arguments.joint.empty())
          throw std::invalid_argument("--joint is for MCAP files; this is a table or a log");
        if (is_table)
          return youbotctl::import_table(arguments.in, arguments.out, arguments.columns, arguments.quiet);
        return youbotctl::convert(arguments.in, arguments.out, arguments.joint, arguments.quiet);
      });
  converting->add_option("--joint", arguments.joint, "of an MCAP file, one joint alone, such as wheel_1");
  converting->add_option("--columns", arguments.columns,
                         "column map of a table that another program wrote, TOML (apps/FILE_FORMATS.md)");
  file_command(
      "recover",
      "write what can be read of a torn MCAP file into a complete one and report how much was lost; needs "
      "no youbotd",
      [&] { return youbotctl::recover(arguments.in, arguments.out, arguments.quiet); });
  CLI::App* learning =
      command("export",
              "the demonstrations in recordings of teleoperations as a dataset for learning, at a regular "
              "frame rate: "
              "export lerobot RUN-1 RUN-2 DATASET. Needs no youbotd",
              [&] {
                const std::filesystem::path out = arguments.paths.back();
                arguments.paths.pop_back();
                return youbotctl::export_lerobot(arguments.paths, out, arguments.lerobot, arguments.quiet);
              });
  learning->add_option("format", "lerobot: of LeRobot, version 3.0")
      ->required()
      ->check(CLI::IsMember({"lerobot"}));
  // One list, because the library gives all of them to the first of two options.
  learning
      ->add_option(
          "paths", arguments.paths,
          "recordings, CSV, MCAP or directories of runs, an episode each; last the directory to create")
      ->required()
      ->expected(2, std::numeric_limits<int>::max());
  learning
      ->add_option("--fps", arguments.lerobot.frames.fps,
                   "frames per second; no more than the recordings have rows")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  learning->add_option("--task", arguments.lerobot.task, "what the operator did, in words")
      ->capture_default_str();
  learning->add_flag("--all-phases", arguments.lerobot.frames.all_phases,
                     "all rows of a recording, also before and after the operation");
  return runtime::run_app(app, argc, argv, [&] { return chosen(); });
}
