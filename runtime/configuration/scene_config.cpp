#include "runtime/configuration/scene_config.h"

#include <cstddef>
#include <span>

#include "runtime/configuration/shared_tables.h"

namespace runtime {
namespace {

/// Walls and tables: each is checked for contact in each step of the simulation.
constexpr std::size_t kMaxBodies = 64;

sim::Surface read_surface(TomlTable& table) {
  sim::Surface surface;
  table.number("stiffness_N_per_m", surface.stiffness_N_per_m, {.min = 10, .max = 1e5});
  table.number("loss_s_per_m", surface.loss_s_per_m, {.min = 0, .max = 100});
  table.number("friction", surface.friction, {.min = 0, .max = 2});
  return surface;
}

sim::Block read_block(TomlTable& table) {
  sim::Block block;
  table.numbers("centre_m", std::span(block.centre_W_m.data(), 3), {.min = -100, .max = 100});
  table.numbers("size_m", std::span(block.size_m.data(), 3), {.min = 0.001, .max = 100});
  block.surface = read_surface(table);
  return block;
}

}  // namespace

void read_scene(TomlTable table, sim::EnvironmentParameters& scene) {
  for (TomlTable& wall : table.tables("wall", {.most = kMaxBodies})) {
    sim::Wall& read = scene.walls.emplace_back();
    wall.numbers("point_m", std::span(read.p_W_m.data(), 3), {.min = -100, .max = 100});
    wall.numbers("normal", std::span(read.normal_W.data(), 3), {.min = -1, .max = 1});
    if (read.normal_W.isZero()) wall.refuse("normal", "is zero: it points out of the wall");
    read.surface = read_surface(wall);
  }
  for (TomlTable& block : table.tables("table", {.most = kMaxBodies}))
    scene.tables.push_back(read_block(block));
  for (TomlTable& block : table.tables("box")) {
    if (scene.box) block.refuse("mass_kg", "is of a second box: there can be one");
    sim::FreeBox& box = scene.box.emplace();
    box.block = read_block(block);
    block.number("mass_kg", box.mass_kg, {.min = 0.01, .max = 50});
  }
}

sim::EnvironmentParameters load_scene(const std::filesystem::path& path) {
  TomlFile file = TomlFile::parse(path);
  sim::EnvironmentParameters scene;
  TomlTable root = file.root();
  leave_to_others(root, {"scene"});
  read_scene(root.table("scene"), scene);
  file.finish();
  return scene;
}

}  // namespace runtime
