// Objects that a simulated robot can touch, as described by a [scene], and the end effector that touches
// them.
#include <algorithm>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "runtime/configuration/scene_config.h"
#include "runtime/configuration/toml_reader.h"
#include "sim/environment.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

using fuzz::require;

/// Negated so that NaN fails.
void within(double value, double least, double most) { require(value >= least && value <= most); }

void check(const Eigen::Vector3d& vector, double least, double most) {
  for (const double value : vector) within(value, least, most);
}
void check(const sim::Surface& surface) {
  within(surface.stiffness_N_per_m, 10, 1e5);
  within(surface.loss_s_per_m, 0, 100);
  within(surface.friction, 0, 2);
}
void check(const sim::Block& block) {
  check(block.centre_W_m, -100, 100);
  check(block.size_m, 0.001, 100);
  check(block.surface);
}

/// An end effector that moves through all of it for a tenth of a second feels a finite force.
void touch(const sim::EnvironmentParameters& scene) {
  constexpr double kStep_s = 0.001;
  sim::Environment environment(scene);
  const Eigen::Vector3d v_WT_m_per_s(2, 0.5, -0.5);
  Eigen::Vector3d p_WT_m(-0.1, 0, 0.05);
  for (int i = 0; i < 100; ++i) {
    require(environment.step(p_WT_m, v_WT_m_per_s, kStep_s).allFinite());
    p_WT_m += kStep_s * v_WT_m_per_s;
  }
  if (scene.box) require(environment.box_p_W_m().allFinite() && environment.box_v_W_m_per_s().allFinite());
}

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  std::vector<Bytes> seeds;
  for (const std::string_view text :
       {"[[scene.wall]]\npoint_m = [0.05, 0.0, 0.0]\nnormal = [-1, 0, 0]\nstiffness_N_per_m = 2000\n"
        "loss_s_per_m = 0.5\nfriction = 0.3\n",
        "[[scene.table]]\ncentre_m = [0, 0, 0.1]\nsize_m = [0.5, 0.5, 0.2]\n[[scene.box]]\n"
        "centre_m = [0, 0, 0.25]\nsize_m = [0.1, 0.1, 0.1]\nmass_kg = 0.4\nfriction = 0.5\n",
        "robot = \"wire\"\n[scene]\nwall = [{ normal = [1e-3, 0, 0] }, { normal = [0, 0, 1] }]\n"})
    seeds.push_back(bytes_of(text));
  return seeds;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::MemoryFile file;
  file.hold({data, size});
  try {
    const sim::EnvironmentParameters scene = runtime::load_scene(file.path());
    for (const sim::Wall& wall : scene.walls) {
      check(wall.p_W_m, -100, 100);
      check(wall.normal_W, -1, 1);
      check(wall.surface);
    }
    std::ranges::for_each(scene.tables, [](const sim::Block& block) { check(block); });
    if (scene.box) {
      check(scene.box->block);
      within(scene.box->mass_kg, 0.01, 50);
    }
    touch(scene);
  } catch (const runtime::ConfigError& error) {
    require(!error.problems().empty());
    for (const std::string& problem : error.problems()) require(problem.starts_with(file.path() + ":"));
  }
  return 0;
}
