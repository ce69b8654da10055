#include "tests/gap_second/recording.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace gap_second {
namespace {

std::string digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

/// TOML keeps integers apart from floating-point numbers.
std::string toml_float(double value) {
  std::string text = digits(value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

void write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path);
}

}  // namespace

std::vector<double>& Recording::at(const std::string& name) {
  for (Column& column : columns)
    if (column.name == name) return column.values;
  throw std::out_of_range("the recording has no column " + name);
}

bool Recording::has(const std::string& name) const {
  return std::any_of(columns.begin(), columns.end(),
                     [&](const Column& column) { return column.name == name; });
}

void Recording::remove_column(const std::string& name) {
  std::erase_if(columns, [&](const Column& column) { return column.name == name; });
}

void Recording::remove_rows(const std::vector<bool>& gone) {
  for (Column& column : columns) {
    std::size_t kept = 0;
    for (std::size_t row = 0; row < column.values.size(); ++row)
      if (!gone[row]) column.values[kept++] = column.values[row];
    column.values.resize(kept);
  }
}

void Recording::write(const std::string& path) const {
  std::string text = "# youbot recording v1\n";
  for (const auto& [key, value] : header)
    text.append("# ").append(key).append(": ").append(value).append("\n");
  for (const Column& column : columns) text.append(&column == columns.data() ? "" : ",").append(column.name);
  text += '\n';
  for (std::size_t row = 0; row < rows(); ++row) {
    for (const Column& column : columns)
      text.append(&column == columns.data() ? "" : ",").append(digits(column.values[row]));
    text += '\n';
  }
  write_file(path, text);
}

void BaseModel::write(const std::string& path) const {
  std::string text = "format = \"youbot-drive-model/1\"\nname = \"" + name + "\"\n";
  text += "inertia_kg_m2 = " + toml_float(inertia_kg_m2) + "\n";
  if (encoder_ticks_per_rev > 0 || torque_noise_Nm > 0) text += "\n[sensor]\n";
  if (encoder_ticks_per_rev > 0)
    text += "encoder_ticks_per_rev = " + std::to_string(encoder_ticks_per_rev) + "\n";
  if (torque_noise_Nm > 0) text += "torque_noise_Nm = " + toml_float(torque_noise_Nm) + "\n";
  for (const ModelEffect& effect : effects) {
    text += "\n[[effect]]\ntype = \"" + effect.type + "\"\n";
    for (const auto& [parameter, value] : effect.parameters)
      text += parameter + " = " + toml_float(value) + "\n";
  }
  write_file(path, text);
}

}  // namespace gap_second
