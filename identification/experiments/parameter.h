/// @file
/// List of an experiment's configuration values, shared by command line, file and range check.
#pragma once
#include <cmath>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace identification::experiments {

/// A configuration has `template <typename Visitor> void visit(Visitor&& v)`, which calls
/// `v(Parameter{...}, value)` for each value: double, int, bool or std::string.
struct Parameter {
  const char* key;   ///< with its unit: "settle_s"
  const char* help;  ///< without the unit
  double min = 0.0;  ///< allowed, as is max; for numbers only
  double max = 0.0;
};

inline std::string number_text(double value) {
  std::string text = std::to_string(value);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text;
}

/// The same. @throws std::invalid_argument naming the first value that is not finite or out of range.
template <typename Config>
Config checked(Config config) {
  config.visit([](const Parameter& parameter, const auto& value) {
    if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(value)>> &&
                  !std::is_same_v<std::remove_cvref_t<decltype(value)>, bool>) {
      const auto number = static_cast<double>(value);
      if (!(number >= parameter.min && number <= parameter.max))
        throw std::invalid_argument(std::string(parameter.key) + " = " + number_text(number) +
                                    ", allowed is " + number_text(parameter.min) + " to " +
                                    number_text(parameter.max));
    }
  });
  return config;
}

}  // namespace identification::experiments
