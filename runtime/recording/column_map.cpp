#include "runtime/recording/column_map.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <system_error>
#include <utility>

#include "runtime/configuration/closest_name.h"
#include "runtime/configuration/toml_reader.h"

namespace runtime {
namespace {

bool parse_number(std::string_view field, char decimal, double& value) {
  if (field.starts_with('+')) field.remove_prefix(1);
  std::array<char, 64> text{};
  if (field.empty() || field.size() > text.size()) return false;
  std::ranges::copy(field, text.begin());
  if (decimal != '.') {
    if (field.find('.') != field.npos) return false;  // a thousands separator, or another decimal point
    std::ranges::replace(text, decimal, '.');
  }
  const auto [end, error] = std::from_chars(text.data(), text.data() + field.size(), value);
  return error == std::errc() && end == text.data() + field.size();
}

/// A table without a row of names begins with values, of which some may be missing.
bool are_numbers(std::span<const std::string> names) {
  double value = 0;
  return std::ranges::any_of(names, [](const std::string& name) { return !name.empty(); }) &&
         std::ranges::all_of(names, [&](const std::string& name) {
           return name.empty() || parse_number(name, '.', value) || parse_number(name, ',', value);
         });
}

constexpr double kLargestServoValue = 1e6;  // kp, V
constexpr double kMapPi = std::numbers::pi;

enum class Kind : std::uint8_t { kTime, kAngle, kVelocity, kTorque, kCurrent, kTemperature };

struct Quantity {
  std::string_view name;
  Kind kind;
};
constexpr std::array kQuantities{Quantity{"time_s", Kind::kTime},
                                 Quantity{"position_rad", Kind::kAngle},
                                 Quantity{"velocity_rad_per_s", Kind::kVelocity},
                                 Quantity{"torque_measured_Nm", Kind::kTorque},
                                 Quantity{"torque_command_Nm", Kind::kTorque},
                                 Quantity{"position_command_rad", Kind::kAngle},
                                 Quantity{"velocity_command_rad_per_s", Kind::kVelocity},
                                 Quantity{"current_A", Kind::kCurrent},
                                 Quantity{"temperature_C", Kind::kTemperature}};

/// A unit that is SI only with a number of the device has `needs`, its key; `inverse`: divided by it.
struct Unit {
  std::string_view name;
  Kind kind;
  double scale;
  double offset = 0;  ///< SI; added after the scale
  std::string_view needs{};
  bool inverse = false;
};
constexpr std::string_view kCounts = "counts_per_rev";
constexpr std::string_view kTorqueConstant = "torque_constant_Nm_per_A";
constexpr std::array kMapUnits{
    Unit{"s", Kind::kTime, 1},
    Unit{"ms", Kind::kTime, 1e-3},
    Unit{"us", Kind::kTime, 1e-6},
    Unit{"ns", Kind::kTime, 1e-9},
    Unit{"min", Kind::kTime, 60},
    Unit{"rad", Kind::kAngle, 1},
    Unit{"mrad", Kind::kAngle, 1e-3},
    Unit{"deg", Kind::kAngle, kMapPi / 180},
    Unit{"turns", Kind::kAngle, 2 * kMapPi},
    Unit{"counts", Kind::kAngle, 2 * kMapPi, 0, kCounts, true},
    Unit{"rad/s", Kind::kVelocity, 1},
    Unit{"deg/s", Kind::kVelocity, kMapPi / 180},
    Unit{"turns/s", Kind::kVelocity, 2 * kMapPi},
    Unit{"rpm", Kind::kVelocity, kMapPi / 30},
    Unit{"counts/s", Kind::kVelocity, 2 * kMapPi, 0, kCounts, true},
    Unit{"Nm", Kind::kTorque, 1},
    Unit{"mNm", Kind::kTorque, 1e-3},
    Unit{"uNm", Kind::kTorque, 1e-6},
    Unit{"Ncm", Kind::kTorque, 1e-2},
    Unit{"A", Kind::kTorque, 1, 0, kTorqueConstant},
    Unit{"mA", Kind::kTorque, 1e-3, 0, kTorqueConstant},
    Unit{"A", Kind::kCurrent, 1},
    Unit{"mA", Kind::kCurrent, 1e-3},
    Unit{"C", Kind::kTemperature, 1},
    Unit{"K", Kind::kTemperature, 1, -273.15},
};

std::string units_of(Kind kind) {
  std::string list;
  for (const Unit& unit : kMapUnits)
    if (unit.kind == kind) (list += list.empty() ? "" : ", ") += unit.name;
  return list;
}

/// "N·m" as "Nm": without signs of multiplication.
std::string without_times(std::string unit) {
  for (const std::string_view sign : {"·", "⋅", "*", "."})
    for (std::size_t at = 0; (at = unit.find(sign, at)) != std::string::npos;) unit.erase(at, sign.size());
  return unit;
}

/// Angle and velocity are divided by the gear's ratio, torque is multiplied by it.
double to_joint(Kind kind, double gear_ratio) { return kind == Kind::kTorque ? gear_ratio : 1 / gear_ratio; }
bool has_side(Kind kind) { return kind == Kind::kAngle || kind == Kind::kVelocity || kind == Kind::kTorque; }

class MapReader {
 public:
  explicit MapReader(TomlFile file) : file_(std::move(file)), root_(file_.root()) {}

  ColumnMap read(const std::filesystem::path& path) {
    map_.name = path.string();
    constexpr std::string_view kFormat = "youbot-column-map/1";
    std::string format;
    root_.text("format", format, {.required = true});
    if (!format.empty() && format != kFormat)
      root_.refuse("format", "is '" + format + "'; this program reads '" + std::string(kFormat) + "'");
    root_.text("rig", map_.rig);
    root_.choice("separator", map_.separator, {{",", ','}, {";", ';'}, {"tab", '\t'}});
    root_.choice("decimal", map_.decimal, {{".", '.'}, {",", ','}});
    if (map_.decimal == ',' && map_.separator == ',')
      root_.refuse("decimal", "is the separator, too; no number could be read");
    root_.number("gear_ratio", gear_ratio_, {.min = 1e-6, .max = 1e6});
    for (const Quantity& quantity : kQuantities)
      if (root_.has(quantity.name)) read_quantity(quantity);
    TomlTable only = root_.table("only");
    if (!only.empty()) {
      only.text("column", map_.only_column, {.required = true});
      only.text("value", map_.only_value, {.required = true});
    }
    require_enough();
    file_.finish();
    return std::move(map_);
  }

 private:
  void read_quantity(const Quantity& quantity) {
    TomlTable table = root_.table(quantity.name);
    if (quantity.name == "torque_command_Nm" && table.has("servo")) {
      read_servo(table.table("servo"));
      return;
    }
    MappedColumn column{.quantity = std::string(quantity.name), .column = {}};
    table.text("column", column.column, {.required = true});
    std::string unit_name;
    table.text("unit", unit_name, {.required = true});
    const auto* const unit =
        std::ranges::find_if(kMapUnits, [&, known = without_times(unit_name)](const Unit& one) {
          return one.kind == quantity.kind && one.name == known;
        });
    if (unit != kMapUnits.end()) {
      column.scale = unit->scale;
      column.offset = unit->offset;
      if (!unit->needs.empty()) {
        double number = 1;
        table.number(unit->needs, number, {.min = 1e-9, .max = 1e9, .required = true});
        column.scale *= unit->inverse ? 1 / number : number;
      }
    } else if (!unit_name.empty()) {
      table.refuse(
          "unit", "is '" + unit_name + "'; for " + column.quantity + " there are " + units_of(quantity.kind));
      table.ignore(kCounts);
      table.ignore(kTorqueConstant);
    }
    double sign = 1;
    table.number("sign", sign, {.min = -1, .max = 1});
    if (std::abs(sign) != 1) table.refuse("sign", "is 1 or -1");
    double factor = 1;
    table.number("factor", factor);
    if (factor == 0) table.refuse("factor", "is 0: every value would be the same");
    column.scale *= sign * factor;
    if (quantity.kind == Kind::kAngle && table.has("wraps_at"))
      table.number("wraps_at", column.wraps_at, {.min = 1e-6, .max = 1e12});
    if (has_side(quantity.kind)) {
      bool motor = false;
      table.choice("side", motor, {{"joint", false}, {"motor", true}});
      if (motor && !(gear_ratio_ > 0))
        table.refuse("side", "is 'motor', but there is no gear_ratio at the top of the file");
      if (motor && gear_ratio_ > 0) column.scale *= to_joint(quantity.kind, gear_ratio_);
    }
    map_.columns.push_back(std::move(column));
  }

  void read_servo(TomlTable table) {
    ServoLaw law;
    table.number("error_gain_per_rad", law.error_gain_per_rad, {.min = 1e-12, .max = 1e6, .required = true});
    table.number("max_duty", law.max_duty, {.min = 1e-3, .max = 1});
    table.number(kTorqueConstant, law.torque_constant_Nm_per_A, {.min = 1e-9, .max = 1e6, .required = true});
    table.number("resistance_ohm", law.resistance_ohm, {.min = 1e-6, .max = 1e6, .required = true});
    const auto optional_number = [&table](std::string_view key, std::optional<double>& value) {
      double found = std::nan("");
      table.number(key, found, {.min = 0, .max = kLargestServoValue});
      if (std::isfinite(found)) value = found;
    };
    optional_number("kp", law.kp);
    optional_number("supply_V", law.supply_V);
    map_.servo = law;
  }

  bool maps(std::string_view quantity) const {
    return std::ranges::find(map_.columns, quantity, &MappedColumn::quantity) != map_.columns.end();
  }

  void require_enough() {
    if (!root_.has("time_s")) root_.refuse("time_s", "is missing; every recording needs it: [time_s]");
    if (!root_.has("position_rad") && !root_.has("velocity_rad_per_s"))
      root_.refuse("position_rad", "and velocity_rad_per_s are missing; a recording needs one of them");
    if (map_.servo && !(maps("position_rad") && maps("position_command_rad")))
      root_.refuse("torque_command_Nm",
                   "of a servo needs [position_rad] and [position_command_rad], whose difference it follows");
  }

  TomlFile file_;
  TomlTable root_;
  ColumnMap map_;
  double gear_ratio_ = 0;
};

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string result = "'";
  for (const char c : text.substr(0, kLongest))
    result += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  return result + (text.size() > kLongest ? "…'" : "'");
}

}  // namespace

ColumnMap read_column_map(const std::filesystem::path& path) {
  return MapReader(TomlFile::parse(path)).read(path);
}

ColumnMapper::ColumnMapper(const ColumnMap& map, std::span<const std::string> names,
                           const std::map<std::string, double, std::less<>>& header)
    : map_(map) {
  std::vector<bool> used(names.size(), false);
  for (const MappedColumn& column : map.columns) {
    const auto at = find(names, column.column, "[" + column.quantity + "]");
    if (at) used[*at] = true;
    at_.push_back(at.value_or(0));
    turns_.emplace_back();
    quantities_.push_back(column.quantity);
  }
  if (!map.only_column.empty()) {
    only_at_ = find(names, map.only_column, "[only]");
    if (only_at_) used[*only_at_] = true;
  }
  if (!problems_.empty() && are_numbers(names)) {
    std::string list;
    for (const MappedColumn& column : map.columns)
      (list += list.empty() ? "" : ", ") += in_quotes(column.column);
    problems_ = {"this line has only numbers: put a row of names before it, with the columns that " +
                 map.name + " names: " + list};
    return;
  }
  for (std::size_t i = 0; i < names.size(); ++i)
    if (!used[i]) left_out_.push_back(names[i]);
  if (map.servo) prepare_servo(header);
}

std::optional<std::size_t> ColumnMapper::find(std::span<const std::string> names, const std::string& column,
                                              const std::string& use) {
  const auto found = std::ranges::find(names, column);
  if (found == names.end()) {
    std::string list;
    for (const std::string& name : names) (list += list.empty() ? "" : ", ") += in_quotes(name);
    std::string hint;
    if (!names.empty())
      if (const auto meant = likely_meant(column, Names(names.begin(), names.end())))
        hint = "; did you mean " + in_quotes(*meant) + "?";
    problems_.push_back("there is no column " + in_quotes(column) + ", which " + use + " of " + map_.name +
                        " names" + hint + "; the columns are " + list);
    return std::nullopt;
  }
  if (std::find(std::next(found), names.end(), column) != names.end()) {
    problems_.push_back("column " + in_quotes(column) + ", which " + use + " of " + map_.name +
                        " names, is there twice; rename one");
    return std::nullopt;
  }
  return static_cast<std::size_t>(found - names.begin());
}

void ColumnMapper::prepare_servo(const std::map<std::string, double, std::less<>>& header) {
  const ServoLaw& law = *map_.servo;
  const auto value = [&](const std::optional<double>& given, std::string_view key, std::string_view logged) {
    if (given) return *given;
    if (const auto found = header.find(logged);
        found != header.end() && found->second >= 0 && found->second <= kLargestServoValue)
      return found->second;
    problems_.push_back("the servo's " + std::string(key) +
                        " is not in the log, or not within 0 to 1e6; set it in " +
                        "[torque_command_Nm.servo] of " + map_.name);
    return 0.0;
  };
  const double supply_V = value(law.supply_V, "supply_V", "vin");
  const double Nm_per_duty = law.torque_constant_Nm_per_A / law.resistance_ohm * supply_V;
  Nm_per_rad_ = Nm_per_duty * law.error_gain_per_rad * value(law.kp, "kp", "kp");
  limit_Nm_ = Nm_per_duty * law.max_duty;
  const auto index = [&](std::string_view quantity) {
    return static_cast<std::size_t>(std::ranges::find(quantities_, quantity) - quantities_.begin());
  };
  command_at_ = index("position_command_rad");
  position_at_ = index("position_rad");
  quantities_.emplace_back("torque_command_Nm");
}

bool ColumnMapper::parse(std::string_view field, double& value) const {
  return parse_number(field, map_.decimal, value);
}

bool ColumnMapper::is_chosen(std::string_view field) const {
  double value = 0;
  double wanted = 0;
  return field == map_.only_value ||
         (parse(field, value) && parse(map_.only_value, wanted) && value == wanted);
}

/// A set-point that wraps begins in the turn that is nearest to the position: both sides of the wrap are
/// near.
void ColumnMapper::align_set_point(std::vector<double>& values) {
  const auto index = [this](std::string_view quantity) {
    return static_cast<std::size_t>(std::ranges::find(map_.columns, quantity, &MappedColumn::quantity) -
                                    map_.columns.begin());
  };
  const std::size_t position = index("position_rad");
  const std::size_t command = index("position_command_rad");
  if (position == map_.columns.size() || command == map_.columns.size()) return;
  const MappedColumn& column = map_.columns[command];
  if (column.wraps_at <= 0) return;
  const double turn_rad = column.wraps_at * column.scale;
  const double turns = std::round((values[position] - values[command]) / turn_rad);
  turns_[command].whole += turns;
  values[command] += turns * turn_rad;
}

ColumnMapper::Row ColumnMapper::convert(std::span<const std::string_view> fields, std::vector<double>& values,
                                        std::string& problem) {
  if (only_at_ && !is_chosen(fields[*only_at_])) return Row::kLeftOut;
  values.clear();
  for (std::size_t i = 0; i < map_.columns.size(); ++i) {
    const MappedColumn& column = map_.columns[i];
    const std::string_view field = fields[at_[i]];
    double value = 0;
    if (!parse(field, value)) {
      problem = "column " + in_quotes(column.column) + " " +
                (field.empty() ? std::string("is empty") : in_quotes(field) + " is not a number");
      const char other = map_.decimal == '.' ? ',' : '.';
      problem += std::ranges::count(field, other) == 1 && field.find(map_.decimal) == field.npos
                     ? "; if '" + std::string(1, other) + "' is its decimal point, set decimal = \"" +
                           std::string(1, other) + "\" in " + map_.name
                     : std::string("; delete the line or measure again");
      return Row::kRefused;
    }
    if (column.quantity == "time_s") {
      if (!first_time_ && std::isfinite(value)) first_time_ = value;
      value -= first_time_.value_or(0);
    }
    if (column.wraps_at > 0 && std::isfinite(value)) {
      Turns& turns = turns_[i];
      if (turns.last) turns.whole -= std::round((value - *turns.last) / column.wraps_at);
      turns.last = value;
      value += turns.whole * column.wraps_at;
    }
    values.push_back(value * column.scale + column.offset);
    if (!std::isfinite(values.back())) {
      problem = "column " + in_quotes(column.column) + " " + in_quotes(field) +
                " is not a finite number; delete the line or measure again";
      return Row::kRefused;
    }
  }
  if (!std::exchange(aligned_, true)) align_set_point(values);
  if (map_.servo)
    values.push_back(
        std::clamp(Nm_per_rad_ * (values[command_at_] - values[position_at_]), -limit_Nm_, limit_Nm_));
  return Row::kTaken;
}

}  // namespace runtime
