// Compares a drive model with recordings, names what the model lacks, and prints how far the gap falls.
//   find_missing_effect MODEL.toml RECORDING.csv...
#include <youbot/identification.h>

#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::fprintf(stderr, "usage: find_missing_effect MODEL.toml RECORDING.csv...\n");
    return 2;
  }
  const youbot::DriveModel given = youbot::read_drive_model(argv[1]);
  std::vector<youbot::gap::Source> data;
  for (int i = 2; i < argc; ++i) {
    youbot::ReadRecording read = youbot::read_recording(argv[i]);
    for (const std::string& warning : read.warnings) std::printf("note: %s\n", warning.c_str());
    data.push_back({.name = argv[i], .recording = std::move(read.recording)});
  }

  // Without held-out recordings, stretches of these are set aside to judge by.
  youbot::gap::Options options;
  options.seed = 1;
  const youbot::gap::Result result = youbot::gap::analyse(given, std::move(data), {}, options);

  std::printf("%s\n", std::string(youbot::gap::verdict_name(result.verdict)).c_str());
  std::printf("gap %.4g -> %.4g N·m on held-out data; noise floor %.4g N·m\n", result.gap_before_Nm,
              result.gap_after_Nm, result.noise_floor_Nm);
  for (const youbot::gap::FoundEffect& found : result.effects) {
    std::printf("+ %s:", std::string(youbot::name_of(found.effect)).c_str());
    for (const auto& parameter : found.parameters)
      std::printf(" %s %.4g (%.4g to %.4g)", parameter.name.c_str(), parameter.value, parameter.lower,
                  parameter.upper);
    std::printf("\n");
    for (const std::string& rival : found.equivalent)
      std::printf("  or %s: these data cannot tell\n", rival.c_str());
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "find_missing_effect: %s\n", error.what());
  return 1;
}
