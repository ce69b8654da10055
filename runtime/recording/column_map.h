/// @file
/// Column map: how the columns of another program's table become those of a recording.
///
///     format = "youbot-column-map/1"
///     gear_ratio = 16                 # for what is on the motor's side
///     [time_s]
///     column = "stamp"
///     unit = "ms"
///     [position_rad]
///     column = "enc"
///     unit = "counts"
///     counts_per_rev = 8192
///     sign = -1
///     side = "motor"
///     [torque_measured_Nm]
///     column = "iq"
///     unit = "A"
///     torque_constant_Nm_per_A = 0.0514
///     side = "motor"
///
/// A recording's value is factor · sign · (value in SI, joint side). Times count from the first row.
#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace runtime {

/// The torque of a servo with a proportional position loop that sets the duty cycle of its voltage, at rest:
///   duty = error_gain · kp · (position command − position), within ±max_duty
///   torque = torque_constant / resistance · supply · duty
/// [Duclusaud et al., ICRA 2025, arXiv 2410.08650]. Back-EMF is not in it: it acts like viscous friction of
/// torque_constant² / resistance.
struct ServoLaw {
  double error_gain_per_rad = 0;
  double max_duty = 1;
  double torque_constant_Nm_per_A = 0;
  double resistance_ohm = 0;
  std::optional<double> kp{};        ///< without it, that of the log
  std::optional<double> supply_V{};  ///< likewise
};

struct MappedColumn {
  std::string quantity;  ///< column of the recording: position_rad
  std::string column;    ///< of the table
  double scale = 1;      ///< SI, joint side, sign and factor
  double offset = 0;     ///< SI; added after the scale
  double wraps_at = 0;   ///< unit of the table; at which the count starts again; 0: never
};

struct ColumnMap {
  std::string name{};  ///< of its file, for messages
  std::string rig{};
  char separator = 0;  ///< 0: semicolon, tab or comma, whichever the row of names has
  char decimal = '.';
  std::vector<MappedColumn> columns{};
  std::optional<ServoLaw> servo{};  ///< gives torque_command_Nm
  /// Rows with another value in this column are left out; an empty column: none.
  std::string only_column{};
  std::string only_value{};
  /// A new value of this quantity starts a new run, whose times may start again; empty: one run.
  std::string run{};
};

/// @throws ConfigError with all problems of the file: another format, a quantity, unit or key that is
/// unknown, a unit without the number that it needs, a motor's side without a gear ratio, no time or no
/// motion.
ColumnMap read_column_map(const std::filesystem::path& path);

/// Turns rows of one table into rows of a recording.
class ColumnMapper {
 public:
  /// `names`: of the table's columns; `header`: further values of the table by name, such as kp. Columns
  /// that are missing or there twice are in problems().
  ColumnMapper(const ColumnMap& map, std::span<const std::string> names,
               const std::map<std::string, double, std::less<>>& header = {});

  const std::vector<std::string>& problems() const noexcept { return problems_; }
  /// Of the recording, in the order of the values.
  const std::vector<std::string>& quantities() const noexcept { return quantities_; }
  /// Columns of the table that the recording does not have.
  const std::vector<std::string>& left_out() const noexcept { return left_out_; }

  enum class Row { kTaken, kLeftOut, kRefused };
  /// One field for each name. `values`: for each quantity; `problem`: why the row was refused.
  Row convert(std::span<const std::string_view> fields, std::vector<double>& values, std::string& problem);

 private:
  /// Of an encoder that counts within one turn only.
  struct Turns {
    std::optional<double> last{};
    double whole = 0;
  };

  std::optional<std::size_t> find(std::span<const std::string> names, const std::string& column,
                                  const std::string& use);
  void prepare_servo(const std::map<std::string, double, std::less<>>& header);
  bool parse(std::string_view field, double& value) const;
  void align_set_point(std::vector<double>& values);
  bool is_chosen(std::string_view field) const;  // by [only]

  const ColumnMap& map_;
  std::vector<std::size_t> at_;  // field of each mapped column
  std::optional<std::size_t> only_at_;
  std::vector<std::string> quantities_;
  std::vector<std::string> left_out_;
  std::vector<std::string> problems_;
  std::optional<double> first_time_;
  std::vector<Turns> turns_;  // of each mapped column
  bool aligned_ = false;
  double Nm_per_rad_ = 0;  // of the servo
  double limit_Nm_ = 0;
  std::size_t command_at_ = 0;  // among the values
  std::size_t position_at_ = 0;
};

}  // namespace runtime
