// youbot-bench on a real network interface, with the emulated robot at the other end.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/veth.h"

namespace {

namespace fs = std::filesystem;

struct Result {
  int exit_code = -1;
  std::string output;
};

/// In the namespace that the test lives in.
Result bench(const std::string& arguments) {
  Result result;
  FILE* pipe = popen((YOUBOT_BENCH_BINARY " " + arguments + " --robot ethercat:veth-c 2>&1").c_str(), "r");
  if (pipe == nullptr) return result;
  std::array<char, 512> line{};
  while (fgets(line.data(), line.size(), pipe) != nullptr) result.output += line.data();
  const int status = pclose(pipe);
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  return result;
}

bool contains(const Result& result, const std::string& text) {
  return result.output.find(text) != std::string::npos;
}

TEST(YoubotBenchOverVeth, DiagnoseFindsADamagedCableAndASlaveThatLeft) {
  const support::Namespaces namespaces;
  if (!namespaces.usable()) GTEST_SKIP() << "needs root and network namespaces";
  const fs::path faults = fs::temp_directory_path() / ("diagnose-" + std::to_string(getpid()) + ".toml");
  const fs::path capture = fs::path(faults).replace_extension(".pcapng");
  // Bring-up takes some hundred frames; a cycle each afterwards.
  std::ofstream(faults) << "[[fault]]\nkind = \"damage_on_cable\"\nat_frame = 1000\ncount = 3\nslave = 2\n"
                           "[[fault]]\nkind = \"slave_off\"\nat_s = 3.0\nduration_s = 0.3\nslave = 4\n";
  const support::Simulator simulator(namespaces, "--robot base --faults " + faults.string());
  ASSERT_TRUE(simulator.ready());
  const Result diagnosis = bench("diagnose --duration 6 --quiet --capture " + capture.string());
  EXPECT_EQ(diagnosis.exit_code, 4) << diagnosis.output;
  EXPECT_TRUE(
      contains(diagnosis, "slave 2 (TMCM-1632) port 0: 3 new CRC errors: check the cable from slave 1"))
      << diagnosis.output;
  EXPECT_TRUE(contains(diagnosis, "slave 4 (TMCM-1632): left operation")) << diagnosis.output;
  EXPECT_TRUE(contains(diagnosis, "wake-up median"));
  EXPECT_GT(fs::file_size(capture), 10'000U);
  fs::remove(faults);
  fs::remove(capture);
}

TEST(YoubotBenchOverVeth, WithoutARobotItSaysWhatToCheck) {
  const support::Namespaces namespaces;
  if (!namespaces.usable()) GTEST_SKIP() << "needs root and network namespaces";
  for (const char* command : {"scan", "parameters", "diagnose --quiet"}) {
    const Result result = bench(command);
    EXPECT_EQ(result.exit_code, 3) << result.output;
    EXPECT_TRUE(contains(result, "veth-c")) << result.output;
  }
}

}  // namespace
