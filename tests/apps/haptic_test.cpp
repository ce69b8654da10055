// Haptic devices as the programs open them, and the command `youbot-bench haptic-hold`.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <thread>

#include "apps/youbot_bench/haptic_hold.h"
#include "hal/setup_error.h"
#include "runtime/open_haptic.h"
#include "runtime/program/exit_code.h"
#include "runtime/recording/recording_reader.h"
#include "tests/support/built_paths.h"
#include "tests/support/run_command.h"
#include "tests/support/temporary_directory.h"

namespace haptic_test {

using namespace std::chrono_literals;

bool says(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

runtime::HapticOptions read(const support::TemporaryDirectory& folder, const std::string& text) {
  const std::filesystem::path path = folder.write("haptic.toml", text);
  runtime::TomlFile file = runtime::TomlFile::parse(path);
  runtime::TomlTable root = file.root();
  runtime::TomlTable table = root.table("haptic");
  runtime::HapticOptions options;
  runtime::read_haptic(table, path.parent_path(), options);
  file.finish();
  return options;
}

TEST(OpenHaptic, NamesThoseThereAre) {
  const hal::VirtualClock clock;
  runtime::HapticOptions options;
  options.name = "phantom";
  try {
    (void)runtime::open_haptic(options, clock, 1ms);
    FAIL();
  } catch (const std::invalid_argument& error) {
    for (const char* name : {"phantom", "loopback", "force-dimension", "falcon", "spacemouse"})
      EXPECT_TRUE(says(error.what(), name)) << error.what();
  }
  EXPECT_TRUE(runtime::is_simulated_haptic("loopback"));
  EXPECT_FALSE(runtime::is_simulated_haptic("falcon"));
}

TEST(OpenHaptic, AnUnknownDeviceInAFileIsReportedWithItsLine) {
  const support::TemporaryDirectory folder;
  try {
    (void)read(folder, "[haptic]\ndevice = \"phantom\"\n");
    FAIL();
  } catch (const runtime::ConfigError& error) {
    EXPECT_TRUE(says(
        error.what(),
        "haptic.toml:2: 'haptic.device' is 'phantom', allowed is loopback, force-dimension or omega.6, "))
        << error.what();
  }
}

TEST(OpenHaptic, TheLoopbackHasAHandInIt) {
  hal::VirtualClock clock;
  const runtime::OpenedHaptic opened = runtime::open_haptic({}, clock, 1ms);
  ASSERT_NE(opened.hand, nullptr);
  opened.device->activate();
  opened.hand->hold_at({0.01, 0, 0});
  hal::HapticSample sample;
  for (int i = 0; i < 3000; ++i) {
    clock.sleep_until(clock.now() + 1ms);
    ASSERT_TRUE(opened.device->exchange({}, sample).ok());
  }
  EXPECT_NEAR(sample.p_HD_m.x(), 0.01, 1e-6);
}

TEST(OpenHaptic, ReadsEveryKey) {
  const support::TemporaryDirectory folder;
  const runtime::HapticOptions options = read(folder, R"(
[haptic]
device = "falcon"
force_limit_N = 5.0
slew_N_per_s = 100.0
speed_limit_m_per_s = 0.7
ramp_in_s = 2.0
stale_after_s = 0.03
command_timeout_s = 0.04
velocity_cutoff_Hz = 60.0
period_s = 0.0005
priority = 70

[haptic.force_dimension]
transport = "usb"
library = "libdrd.so.3"
serial = 4711
allow_motion = true
effector_mass_kg = 0.2
watchdog_s = 0.01

[haptic.falcon]
firmware = "nvent.bin"
usb_port = "1-1.2"
command_per_Nm = -9000.0
origin_m = 0.12
reply_deadline_s = 0.02
lost_after_misses = 7

[haptic.spacemouse]
serial = "A1"
path = "/dev/hidraw3"
travel_m = 0.1
turn_rad = 0.25

[haptic.hand]
device_mass_kg = 0.2
device_drag_N_s_per_m = 0.6
mass_kg = 0.4
stiffness_N_per_m = 200.0
damping_N_s_per_m = 10.0
)");
  EXPECT_EQ(options.name, "falcon");
  EXPECT_EQ(options.force_limit_N, 5.0);
  EXPECT_EQ(options.limits.slew_N_per_s, 100.0);
  EXPECT_EQ(options.limits.speed_m_per_s, 0.7);
  EXPECT_EQ(options.limits.ramp_in, 2s);
  EXPECT_EQ(options.limits.stale_after, 30ms);
  EXPECT_EQ(options.limits.command_timeout, 40ms);
  EXPECT_EQ(options.limits.velocity_cutoff_Hz, 60.0);
  EXPECT_EQ(options.thread.period, 500us);
  EXPECT_EQ(options.thread.fifo_priority, 70);
  EXPECT_EQ(options.force_dimension.transport, hal::ForceDimensionTransport::kUsb);
  EXPECT_TRUE(options.force_dimension.sdk.file.ends_with("/libdrd.so.3")) << "beside the configuration";
  EXPECT_EQ(options.force_dimension.device.serial, 4711);
  EXPECT_TRUE(options.force_dimension.device.allow_motion);
  EXPECT_EQ(options.force_dimension.device.effector_mass_kg, 0.2);
  EXPECT_EQ(options.force_dimension.device.watchdog, 10ms);
  EXPECT_EQ(options.falcon.firmware.filename(), "nvent.bin");
  EXPECT_EQ(options.falcon.port_path, "1-1.2");
  EXPECT_EQ(options.falcon.device.command_per_Nm, -9000.0);
  EXPECT_EQ(options.falcon.device.p_FO_m[2], 0.12);
  EXPECT_EQ(options.falcon.device.reply_deadline, std::chrono::milliseconds(20));
  EXPECT_EQ(options.falcon.device.lost_after_misses, 7);
  EXPECT_EQ(options.space_mouse.choice.serial, "A1");
  EXPECT_EQ(options.space_mouse.choice.path, "/dev/hidraw3");
  EXPECT_EQ(options.space_mouse.travel_m, 0.1);
  EXPECT_EQ(options.space_mouse.turn_rad, 0.25);
  EXPECT_EQ(options.hand.device_mass_kg, 0.2);
  EXPECT_EQ(options.hand.device_drag_N_s_per_m, 0.6);
  EXPECT_EQ(options.hand.hand_mass_kg, 0.4);
  EXPECT_EQ(options.hand.hand_stiffness_N_per_m, 200.0);
  EXPECT_EQ(options.hand.hand_damping_N_s_per_m, 10.0);
}

TEST(OpenHaptic, AFalconWhoseOneMissingReplyEndsTheForceIsRefused) {
  const support::TemporaryDirectory folder;
  try {
    (void)read(folder, "[haptic]\n[haptic.falcon]\nreply_deadline_s = 0.02\n");
    FAIL() << "it was taken";
  } catch (const runtime::ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find(":3: 'haptic.falcon.reply_deadline_s' is not below"),
              std::string::npos)
        << error.what();
  }
  EXPECT_EQ(read(folder, "[haptic]\nstale_after_s = 0.004\n").limits.stale_after,
            std::chrono::milliseconds(4))
      << "of another master";
}

TEST(OpenHaptic, TheConfigurationInTheDocumentShowsTheDefaults) {
  std::ifstream file(support::source_dir() + "/drivers/haptic/README.md");
  const std::string readme{std::istreambuf_iterator<char>(file), {}};
  const std::size_t begin = readme.find("[haptic]\n", readme.find("```toml\n[haptic]"));
  ASSERT_NE(begin, std::string::npos);
  const support::TemporaryDirectory folder;
  const runtime::HapticOptions shown = read(folder, readme.substr(begin, readme.find("```", begin) - begin));
  const runtime::HapticOptions defaults;
  EXPECT_EQ(shown.name, defaults.name);
  EXPECT_EQ(shown.force_limit_N, defaults.force_limit_N);
  EXPECT_EQ(shown.limits.slew_N_per_s, defaults.limits.slew_N_per_s);
  EXPECT_EQ(shown.limits.speed_m_per_s, defaults.limits.speed_m_per_s);
  EXPECT_EQ(shown.limits.ramp_in, defaults.limits.ramp_in);
  EXPECT_EQ(shown.limits.stale_after, defaults.limits.stale_after);
  EXPECT_EQ(shown.limits.command_timeout, defaults.limits.command_timeout);
  EXPECT_EQ(shown.limits.velocity_cutoff_Hz, defaults.limits.velocity_cutoff_Hz);
  EXPECT_EQ(shown.thread.period, defaults.thread.period);
  EXPECT_EQ(shown.thread.fifo_priority, defaults.thread.fifo_priority);
  EXPECT_EQ(shown.force_dimension.transport, defaults.force_dimension.transport);
  EXPECT_EQ(shown.force_dimension.device.allow_motion, defaults.force_dimension.device.allow_motion);
  EXPECT_EQ(shown.force_dimension.device.watchdog, defaults.force_dimension.device.watchdog);
  EXPECT_EQ(shown.falcon.device.command_per_Nm, defaults.falcon.device.command_per_Nm);
  EXPECT_EQ(shown.falcon.device.p_FO_m, defaults.falcon.device.p_FO_m);
  EXPECT_EQ(shown.falcon.device.reply_deadline, defaults.falcon.device.reply_deadline);
  EXPECT_EQ(shown.falcon.device.lost_after_misses, defaults.falcon.device.lost_after_misses);
  EXPECT_EQ(shown.space_mouse.travel_m, defaults.space_mouse.travel_m);
  EXPECT_EQ(shown.space_mouse.turn_rad, defaults.space_mouse.turn_rad);
  EXPECT_EQ(shown.hand.device_mass_kg, defaults.hand.device_mass_kg);
  EXPECT_EQ(shown.hand.device_drag_N_s_per_m, defaults.hand.device_drag_N_s_per_m);
  EXPECT_EQ(shown.hand.hand_mass_kg, defaults.hand.hand_mass_kg);
  EXPECT_EQ(shown.hand.hand_stiffness_N_per_m, defaults.hand.hand_stiffness_N_per_m);
  EXPECT_EQ(shown.hand.hand_damping_N_s_per_m, defaults.hand.hand_damping_N_s_per_m);
}

TEST(OpenHaptic, RefusesWhatIsNotSafeWithFileAndLine) {
  const support::TemporaryDirectory folder;
  for (const char* line : {"force_limit_N = 13.0", "ramp_in_s = 0.0", "stale_after_s = 1.0",
                           "speed_limit_m_per_s = nan", "watchdog = 0"}) {
    try {
      (void)read(folder, std::string("[haptic]\n") + line + "\n");
      ADD_FAILURE() << line;
    } catch (const runtime::ConfigError& error) {
      EXPECT_TRUE(says(error.what(), "haptic.toml:2")) << error.what();
    }
  }
  EXPECT_THROW((void)read(folder, "[haptic.force_dimension]\nwatchdog_s = 0.0\n"), runtime::ConfigError)
      << "never off";
}

TEST(OpenHaptic, AFirmwareFileThatCannotBeReadIsNamed) {
  const support::TemporaryDirectory folder;
  const hal::VirtualClock clock;
  runtime::HapticOptions options;
  options.name = "falcon";
  for (const std::filesystem::path& path :
       {folder.path() / "missing.bin", folder.path(), folder.write("empty.bin", ""),
        folder.write("long.bin", std::string((1 << 20) + 1, 'x'))}) {
    options.falcon.firmware = path;
    try {
      (void)runtime::open_haptic(options, clock, 1ms);
      ADD_FAILURE() << path;
    } catch (const hal::SetupError& error) {
      EXPECT_TRUE(says(error.what(), path.string())) << error.what();
    }
  }
}

support::CommandResult hold(const std::string& arguments) {
  return support::run_command(support::program("youbot-bench") + " haptic-hold " + arguments);
}

TEST(HapticHold, APenThatIsLetGoReturnsToThePointAndGivesNoEnergy) {
  const support::TemporaryDirectory folder;
  const std::string out = (folder.path() / "out").string();
  const auto result = hold("--virtual-time --duration 20 --stiffness 300 --out " + out);
  ASSERT_EQ(result.exit_code, 0) << result.output;
  EXPECT_TRUE(says(result.output, "energy given to the hand")) << result.output;
  EXPECT_TRUE(std::filesystem::exists(out + "/report.html"));

  const identification::Recording recording = runtime::read_recording(out + "/haptic.csv").recording;
  const std::span<const double> time_s = recording.column("time_s");
  const std::span<const double> y_m = recording.column("position_y_m");
  const std::span<const double> force_N = recording.column("force_y_N");
  const std::span<const double> energy_J = recording.column("energy_J");
  EXPECT_NEAR(static_cast<double>(time_s.size()), 20000, 20);
  // The hand means to be 30 mm aside, and has 300 N/m as the spring has: it gets half-way.
  EXPECT_NEAR(*std::min_element(y_m.begin(), y_m.end()), -0.015, 0.0005);
  for (std::size_t i = 0; i < time_s.size(); ++i) {
    EXPECT_LE(std::abs(force_N[i]), 8.0);
    EXPECT_LT(energy_J[i], 1e-4) << time_s[i];
  }
  EXPECT_LT(std::abs(y_m.back()), 1e-3);

  const auto again = hold("--virtual-time --duration 1 --out " + out);
  EXPECT_EQ(again.exit_code, 2) << "a recording is never replaced";
  EXPECT_TRUE(says(again.output, "haptic.csv is there already and is not replaced")) << again.output;
}

TEST(HapticHold, InterruptedBeforeItsTimeItSaysSoByItsExitCode) {
  std::atomic<bool> stop{true};
  EXPECT_EQ(youbot_bench::haptic_hold({.virtual_time = true, .quiet = true}, stop), runtime::kExitInterrupted)
      << "before the first sample";
  stop = false;
  const support::TemporaryDirectory folder;
  std::thread user([&] {
    while (!std::filesystem::exists(folder / "haptic.csv")) std::this_thread::yield();  // it has begun
    stop = true;
  });
  EXPECT_EQ(
      youbot_bench::haptic_hold(
          {.duration_s = 20'000, .out = folder.path().string(), .virtual_time = true, .quiet = true}, stop),
      runtime::kExitInterrupted);
  user.join();
}

TEST(HapticHold, OneFileServesAllPrograms) {
  const support::TemporaryDirectory folder;
  std::ifstream demo(support::source_dir() + "/apps/youbotd/demo.toml");
  const std::string robot{std::istreambuf_iterator<char>(demo), {}};
  const std::string file = folder.write("all.toml", robot + "\n[haptic]\nforce_limit_N = 3.0\n").string();
  const auto held = hold("--virtual-time --duration 1 --config " + file);
  EXPECT_EQ(held.exit_code, 0) << held.output;
  EXPECT_TRUE(held.said("3 N at most")) << held.output;
  const auto driven = support::run_command(support::program("youbotd") +
                                           " --virtual-time --duration 0.1 --allow-non-rt --config " + file);
  EXPECT_EQ(driven.exit_code, 0) << driven.output;
}

TEST(HapticHold, WrongUseIsToldAndNothingMoves) {
  const support::TemporaryDirectory folder;
  EXPECT_EQ(hold("--haptic phantom --virtual-time").exit_code, 2);
  EXPECT_TRUE(says(hold("--haptic falcon --virtual-time").output, "real time"));
  EXPECT_EQ(hold("--haptic falcon --virtual-time").exit_code, 2);
  EXPECT_EQ(hold("--virtual-time --stiffness 1e9").exit_code, 2);
  EXPECT_EQ(hold("--virtual-time --duration 1 --config " + (folder.path() / "none.toml").string()).exit_code,
            2);
  const auto wrong = folder.write("wrong.toml", "[haptic]\nforce_limit = 3\n");
  const auto result = hold("--virtual-time --duration 1 --config " + wrong.string());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(says(result.output, "wrong.toml:2")) << result.output;
}

}  // namespace haptic_test
