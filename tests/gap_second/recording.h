/// @file
/// A recording and a drive model as files, written from apps/FILE_FORMATS.md alone.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace gap_second {

struct Column {
  std::string name;
  std::vector<double> values;
};

struct Recording {
  std::vector<std::pair<std::string, std::string>> header;
  std::vector<Column> columns;  ///< all of the same length

  std::size_t rows() const { return columns.empty() ? 0 : columns.front().values.size(); }
  /// @throws std::out_of_range if there is none.
  std::vector<double>& at(const std::string& name);
  bool has(const std::string& name) const;
  void remove_column(const std::string& name);
  void remove_rows(const std::vector<bool>& gone);
  /// @throws std::runtime_error naming the file if it cannot be written.
  void write(const std::string& path) const;
};

struct ModelEffect {
  std::string type;
  std::map<std::string, double> parameters;
};

struct BaseModel {
  std::string name;
  double inertia_kg_m2 = 0.0;
  int encoder_ticks_per_rev = 0;  ///< 0: unspecified
  double torque_noise_Nm = 0.0;   ///< 0: unspecified
  std::vector<ModelEffect> effects;

  void write(const std::string& path) const;
};

}  // namespace gap_second
