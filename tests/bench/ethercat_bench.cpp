// ethercat_bench: cost of a bus of eleven slaves (base and arm): bring-up, round trip, CPU. youbot-sim serves
// them at the other end of a veth pair; the compared masters take turns, so that the machine's noise affects
// all of them. Needs root. Cycles are paced at 1 kHz; nothing here fails because a machine is slow. Both ends
// run with real-time priority, so that the scheduler separates them: otherwise a polling master blocks the
// simulator's core for up to a time slice.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "drivers/latency_histogram.h"
#include "tests/bench/ethercat_master.h"
#include "tests/bench/figures.h"
#include "tests/support/veth.h"

namespace {

using std::chrono::nanoseconds;

constexpr int kRounds = 4;
constexpr int kCycles = 1200;  // of each master in each round
constexpr std::chrono::seconds kTimeLimit{45};
constexpr int kSlaves = 11;
constexpr const char* kInterface = "veth-c";

struct Row {
  std::string name;
  std::function<std::unique_ptr<bench::Master>()> make;
  drivers::LatencyHistogram round_trips = {};
  std::vector<nanoseconds> bring_ups = {};
  std::uint64_t bring_up_frames = 0;
  nanoseconds cpu = {};
  std::uint64_t replies = 0;
  int cycles = 0;
  int incomplete = 0;
};

const char* scheduling(bool real_time) { return real_time ? "SCHED_FIFO" : "without real-time priority"; }
double microseconds(nanoseconds time) { return std::chrono::duration<double, std::micro>(time).count(); }
double milliseconds(nanoseconds time) { return microseconds(time) / 1000.0; }

void run_round(Row& row) {
  const std::unique_ptr<bench::Master> master = row.make();
  const std::uint64_t frames = bench::frames_sent(kInterface);
  const nanoseconds begin = bench::now();
  master->bring_up();
  row.bring_ups.push_back(bench::now() - begin);
  row.bring_up_frames = bench::frames_sent(kInterface) - frames;

  // The sleeping between two cycles is in the CPU time of all alike.
  const nanoseconds cpu = bench::thread_cpu();
  nanoseconds next = bench::now();
  for (int i = 0; i < kCycles; ++i) {
    next = std::max(next + std::chrono::milliseconds(1), bench::now());
    bench::sleep_until(next);
    const nanoseconds sent = bench::now();
    const bool complete = master->exchange();
    if (complete)
      row.round_trips.add(bench::now() - sent);
    else
      ++row.incomplete;
  }
  row.cpu += bench::thread_cpu() - cpu;
  row.cycles += kCycles;
  row.replies += master->mailbox_replies();
}

void print(std::vector<Row>& rows, bool real_time) {
  std::printf("%-36s %9s %7s %9s %9s %9s %11s %11s\n", "", "bring-up", "frames", "round trip", "99.9 %",
              "CPU/cycle", "mailbox/s", "incomplete");
  std::printf("%-36s %9s %7s %9s %9s %9s %11s %11s\n", "", "ms", "", "median us", "us", "us", "replies",
              "cycles");
  for (Row& row : rows) {
    if (row.bring_ups.empty()) continue;
    std::sort(row.bring_ups.begin(), row.bring_ups.end());
    std::printf("%-36s %9.1f %7llu %9.1f %9.1f %9.1f %11.0f %6d/%d\n", row.name.c_str(),
                milliseconds(row.bring_ups[row.bring_ups.size() / 2]),
                static_cast<unsigned long long>(row.bring_up_frames),
                microseconds(row.round_trips.quantile(0.5)), microseconds(row.round_trips.quantile(0.999)),
                microseconds(row.cpu) / row.cycles,
                static_cast<double>(row.replies) * 1000.0 / static_cast<double>(row.cycles), row.incomplete,
                row.cycles);
    const std::string bus = std::to_string(kSlaves) + " slaves: " + row.name;
    bench::add_figure("EtherCAT cycle, " + bus,
                      bench::quantiles_text(row.round_trips) + "; " +
                          bench::number_text(microseconds(row.cpu) / row.cycles) + " µs of processor time",
                      "ethercat_bench, " + std::to_string(row.cycles - row.incomplete) + " of " +
                          std::to_string(row.cycles) + " cycles at 1 kHz, veth to youbot-sim, " +
                          scheduling(real_time));
    bench::add_figure("EtherCAT bring-up to OP, " + bus,
                      bench::number_text(milliseconds(row.bring_ups[row.bring_ups.size() / 2])) + " ms, " +
                          std::to_string(row.bring_up_frames) + " frames",
                      "ethercat_bench, median of " + std::to_string(row.bring_ups.size()));
  }
}

int run() {
  const support::Namespaces namespaces;
  if (!namespaces.usable()) {
    std::printf("EtherCAT over veth: not measured, it needs root and network namespaces\n");
    bench::add_figure("EtherCAT cycle", "not measured", "needs root and network namespaces");
    return 0;
  }
  const bool real_time = bench::become_real_time();
  const support::Simulator simulator(namespaces, "--robot base+arm");
  if (!simulator.ready()) throw std::runtime_error("youbot-sim did not start");

  using bench::MailboxLoad;
  using bench::Waiting;
  std::vector<Row> rows;
  const auto ours = [&](const char* name, Waiting waiting, MailboxLoad load) {
    rows.push_back({name, [=] { return bench::make_our_master(kInterface, waiting, load); }});
  };
  ours("ours, blocking", Waiting::kBlock, MailboxLoad::kNone);
  if (bench::built_with_soem())
    rows.push_back({"SOEM (ppoll)", [] { return bench::make_soem_master(kInterface); }});
  if (bench::built_with_kickcat())
    rows.push_back({"KickCAT", [] { return bench::make_kickcat_master(kInterface); }});
  ours("ours, blocking, mailboxes busy", Waiting::kBlock, MailboxLoad::kAll);
  ours("ours, busy wait", Waiting::kBusy, MailboxLoad::kNone);
  ours("ours, busy wait, mailboxes busy", Waiting::kBusy, MailboxLoad::kAll);

  std::printf("EtherCAT over veth, %d slaves of youbot-sim, 1 kHz, %d rounds of %d cycles each, %s\n",
              kSlaves, kRounds, kCycles, scheduling(real_time));
  std::fflush(stdout);
  const nanoseconds end = bench::now() + kTimeLimit;
  for (int round = 0; round < kRounds; ++round)
    for (Row& row : rows) {
      if (bench::now() > end) continue;  // the rows then say how many cycles they had
      try {
        run_round(row);
      } catch (const std::exception& error) {
        // A machine too busy to get the bus up; the others' figures stand.
        std::printf("%s, round %d: %s\n", row.name.c_str(), round + 1, error.what());
      }
    }
  print(rows, real_time);
  return 0;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "ethercat_bench: %s\n", error.what());
    return 1;
  }
}
