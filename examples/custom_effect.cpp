// Adds an effect that the library does not have, a cable that winds up as the joint turns. The search for
// missing effects then tries it together with the effects of the library.
//   custom_effect MODEL.toml RECORDING.csv...
#include <youbot/identification.h>

#include <cstdio>
#include <exception>
#include <string>
#include <utility>
#include <vector>

namespace {

/// Torque against positive motion: k·(θ − θ0). The amplitude k is linear and needs no initial guess; θ0 is
/// the shape, which the search tries at a few values and then fits.
youbot::CustomEffect cable() {
  return {.name = "cable",
          .shows = "torque in proportion to the angle from one position, whatever the speed",
          .amplitude = {.name = "stiffness_Nm_per_rad", .lower = 0, .upper = 10, .initial = 0.01},
          .shape = {{.name = "rest_position_rad", .lower = -100, .upper = 100, .initial = 0}},
          .tried_shapes = {-2, 0, 2},
          .load = [](double position_rad, double rest_rad) noexcept { return position_rad - rest_rad; }};
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::fprintf(stderr, "usage: custom_effect MODEL.toml RECORDING.csv...\n");
    return 2;
  }
  youbot::add_custom_effect(cable());  // before reading models, which may already contain it
  youbot::DriveModel model = youbot::read_drive_model(argv[1]);
  std::vector<youbot::gap::Source> data;
  for (int i = 2; i < argc; ++i)
    data.push_back({.name = argv[i], .recording = youbot::read_recording(argv[i]).recording});

  const youbot::gap::Result result = youbot::gap::analyse(model, std::move(data), {}, {});
  std::printf("%s: gap %.4g -> %.4g N·m, noise floor %.4g N·m\n",
              std::string(youbot::gap::verdict_name(result.verdict)).c_str(), result.gap_before_Nm,
              result.gap_after_Nm, result.noise_floor_Nm);
  for (const youbot::gap::FoundEffect& found : result.effects) {
    model.effects.push_back(found.effect);
    std::printf("+ %s:", std::string(youbot::name_of(found.effect)).c_str());
    for (const auto& parameter : found.parameters)
      std::printf(" %s %.4g (%.4g to %.4g)", parameter.name.c_str(), parameter.value, parameter.lower,
                  parameter.upper);
    std::printf("\n");
  }
  std::printf("\n%s", youbot::drive_model_text(model).c_str());
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "custom_effect: %s\n", error.what());
  return 1;
}
