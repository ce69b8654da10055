#include "model/friction/law.h"

#include <sstream>
#include <stdexcept>

namespace model::friction {

void require_within(std::string_view law, std::string_view parameter, double value, double lower,
                    double upper) {
  if (value >= lower && value <= upper) return;
  std::ostringstream message;
  message << "friction law " << law << ": " << parameter << " = " << value << ", expected " << lower << " to "
          << upper;
  throw std::invalid_argument(message.str());
}

}  // namespace model::friction
