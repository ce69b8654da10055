#include "runtime/configuration/finite_range.h"

#include <spdlog/fmt/fmt.h>

namespace runtime {

CLI::Validator finite_range(double least, double most) {
  const std::string range = fmt::format("{:g} to {:g}", least, most);
  return CLI::Validator(
      [=](std::string& text) {
        double value = 0;
        const bool number = CLI::detail::lexical_cast(text, value);
        return number && value >= least && value <= most ? std::string()
                                                         : "should be " + range + ", not " + text;
      },
      range);
}

}  // namespace runtime
