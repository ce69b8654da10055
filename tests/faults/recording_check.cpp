#include "tests/faults/recording_check.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <utility>

namespace faults {
namespace {

/// A sensor's count and the decimals of the file.
constexpr double kResolution_rad = 2e-4;
/// Milliamperes of a motor: a command is cut to one, a reading is one.
constexpr double kTorqueCounts = 1.01;
constexpr std::size_t kWheels = 4;
constexpr double kArmInTorqueMode = 1;  // column arm_mode

std::string content_of(const std::filesystem::path& file) {
  std::string text(std::filesystem::file_size(file), '\0');
  std::ifstream(file, std::ios::binary).read(text.data(), static_cast<std::streamsize>(text.size()));
  return text;
}

/// Cuts off the text up to the next `end`, and that.
std::string_view cut(std::string_view& text, char end) {
  const std::size_t found = text.find(end);
  const std::string_view first = text.substr(0, found);
  text.remove_prefix(found == text.npos ? text.size() : found + 1);
  return first;
}

/// Not a number where it is none.
double number(std::string_view cell) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  return error == std::errc{} && end == cell.data() + cell.size() ? value
                                                                  : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

void TrueMotion::add(World& world) {
  Moment& moment = moments_.emplace_back();
  moment.at = world.now();
  for (std::size_t joint = 0; joint < world.joints(); ++joint) {
    const sim::bus::TmcmBoard& board = world.emulation().board(joint);
    milliampere_Nm_[joint] = std::abs(board.units().torque_Nm(1));
    moment.position_rad[joint] = world.emulation().position_rad(joint);
    moment.measured_Nm[joint] = board.units().torque_Nm(board.input().current_mA);
    if (!board.followed() || board.followed()->mode != drivers::tmcl::ControllerMode::kCurrent) continue;
    moment.in_torque_mode[joint] = true;
    moment.command_Nm[joint] = board.units().torque_Nm(board.followed()->value);
  }
}

TrueMotion::Window TrueMotion::around(nanoseconds time) const {
  constexpr std::ptrdiff_t kPeriods = 2;
  const auto at = std::ranges::lower_bound(moments_, time, {}, &Moment::at);
  const auto begin = at - std::min(at - moments_.begin(), kPeriods);
  return {begin, at + std::min(moments_.end() - at, kPeriods + 1)};
}

bool TrueMotion::ends_torque_mode(Window window, std::size_t joint) {
  const auto ends = [joint](const Moment& moment, const Moment& next) {
    return moment.in_torque_mode[joint] && !next.in_torque_mode[joint];
  };
  return std::ranges::adjacent_find(window, ends) != window.end();
}

bool TrueMotion::is_true(const Column& column, double value, Reading& reading, Window now) const {
  const auto range = [&column](Window window, auto member) {
    std::pair<double, double> found((window.front().*member)[column.joint],
                                    (window.front().*member)[column.joint]);
    for (const Moment& moment : window) {
      found.first = std::min(found.first, (moment.*member)[column.joint]);
      found.second = std::max(found.second, (moment.*member)[column.joint]);
    }
    return found;
  };
  // Negated by the caller, so that NaN fails.
  const auto within = [value](double least, double most, double tolerance) {
    return value > least - tolerance && value < most + tolerance;
  };
  const auto torque_within = [&](const std::pair<double, double>& torque_Nm) {
    return within(torque_Nm.first, torque_Nm.second, kTorqueCounts * milliampere_Nm_[column.joint]);
  };
  switch (column.quantity) {
    case Quantity::kTank: return value >= 0;
    case Quantity::kArmMode: reading.arm_in_torque_mode = value == kArmInTorqueMode; return true;
    case Quantity::kPosition: {
      const double first_rad = reading.first_rad[column.joint].value_or(value);
      reading.first_rad[column.joint] = first_rad;
      const auto begin = range(reading.begin, &Moment::position_rad);
      const auto end = range(now, &Moment::position_rad);
      return within(first_rad + end.first - begin.second, first_rad + end.second - begin.first,
                    kResolution_rad);
    }
    case Quantity::kCommand: {
      const Window window{reading.last.begin(), now.end()};
      if (column.joint >= kWheels && !reading.arm_was_in_torque_mode) return true;
      // Nothing goes out before the drives obey.
      reading.obeyed[column.joint] =
          reading.obeyed[column.joint] ||
          std::ranges::any_of(now, [&](const Moment& moment) { return moment.in_torque_mode[column.joint]; });
      if (!reading.obeyed[column.joint]) return true;
      bool& unsent = reading.unsent[column.joint];
      const bool followed = torque_within(range(window, &Moment::command_Nm));
      // One row's torque is not sent when the drive is switched off, or changes its mode, before the next
      // exchange.
      const bool excused = !followed && !unsent && ends_torque_mode(window, column.joint);
      unsent = !followed;
      return followed || excused;
    }
    case Quantity::kMeasured: return torque_within(range(now, &Moment::measured_Nm));
  }
  return false;
}

std::vector<std::string> TrueMotion::compare(const std::filesystem::path& folder,
                                             bool samples_are_true) const {
  std::vector<std::string> problems;
  std::size_t found = 0;
  for (std::size_t run = 1; run <= first_cycles_.size(); ++run)
    for (const char* name : {"base.csv", "teleoperation.csv"}) {
      const std::filesystem::path file = folder / ("run-" + std::to_string(run)) / name;
      if (!std::filesystem::exists(file)) continue;
      ++found;
      compare_file(file, first_cycles_[run - 1], samples_are_true, problems);
    }
  if (samples_are_true && found != first_cycles_.size())
    problems.push_back(std::to_string(first_cycles_.size()) + " runs have " + std::to_string(found) +
                       " recordings");
  return problems;
}

std::vector<TrueMotion::Column> TrueMotion::columns_of(std::string_view header) {
  std::vector<Column> columns;
  for (std::size_t index = 0; !header.empty(); ++index) {
    std::string_view rest = cut(header, ',');
    const auto add = [&columns, name = rest, index](Quantity quantity, std::size_t joint = 0) {
      columns.push_back({name, index, quantity, joint});
    };
    if (rest == "tank_J") add(Quantity::kTank);
    if (rest == "arm_mode") add(Quantity::kArmMode);
    const bool wheel = rest.starts_with("wheel_");
    if (!wheel && !rest.starts_with("arm_")) continue;
    (void)cut(rest, '_');
    const double number_in_name = number(cut(rest, '_'));
    if (std::isnan(number_in_name)) continue;
    const std::size_t joint = static_cast<std::size_t>(number_in_name) - 1 + (wheel ? 0 : kWheels);
    // Homing gives the arm another zero in the midst of a run.
    if (wheel && rest == "position_rad") add(Quantity::kPosition, joint);
    if (rest == (wheel ? "torque_command_Nm" : "command")) add(Quantity::kCommand, joint);
    if (rest == "torque_measured_Nm") add(Quantity::kMeasured, joint);
  }
  return columns;
}

void TrueMotion::compare_file(const std::filesystem::path& file, nanoseconds first_cycle,
                              bool samples_are_true, std::vector<std::string>& problems) const {
  const std::string name = file.parent_path().filename().string() + "/" + file.filename().string() + ": ";
  const std::string content = content_of(file);
  std::string_view rest = content;
  std::string_view header = "#";
  while (header.starts_with('#')) header = cut(rest, '\n');
  const auto width = static_cast<std::size_t>(std::ranges::count(header, ',')) + 1;
  Reading reading{.columns = columns_of(header), .begin = around(first_cycle)};
  double last_s = -1;
  std::size_t rows = 0;
  for (std::vector<std::string_view> row; !rest.empty(); row.clear(), ++rows) {
    const bool ends = rest.find('\n') != rest.npos;
    for (std::string_view line = cut(rest, '\n'); !line.empty();) row.push_back(cut(line, ','));
    if (!ends || row.size() != width)
      return problems.push_back(name + "row " + std::to_string(rows) + " is torn");
    const double time_s = number(row[0]);
    if (!(time_s > last_s)) problems.push_back(name + "time stands still at " + std::string(row[0]));
    last_s = time_s;
    const Window now = around(first_cycle + nanoseconds(std::llround(1e9 * time_s)));
    reading.arm_was_in_torque_mode = reading.arm_in_torque_mode;
    for (const Column& column : reading.columns) {
      if (!samples_are_true && column.quantity != Quantity::kTank) continue;
      const double value = number(row[column.index]);
      const bool command = column.quantity == Quantity::kCommand;
      const double held = command ? std::exchange(reading.commands[column.joint], value) : value;
      if (command && rows == 0) continue;
      if (!is_true(column, held, reading, now))
        return problems.push_back(name + "at " + std::string(row[0]) + " s " + std::string(column.name) +
                                  " was not " + std::to_string(held) +
                                  (command ? " since the row before" : ""));
    }
    reading.last = now;
  }
  if (samples_are_true && rows == 0 && first_cycle.count() >= 0) problems.push_back(name + "no rows");
}

}  // namespace faults
