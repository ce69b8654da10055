#include "drivers/tmcl/parameter_application.h"

namespace drivers::tmcl {

Action ParameterApplication::run(const DriveInput& /*input*/) noexcept {
  Action action;
  action.drive = kStopMotor;
  if (next_ == settings_.size()) {
    finish();
    return action;
  }
  const ParameterSetting& setting = settings_[next_];
  if (!written_) {
    written_ = ask(set(*setting.parameter, setting.value), action).has_value();
    return action;
  }
  if (const auto value = ask(get(*setting.parameter), action)) {
    if (*value != setting.value) fail(SequenceFault::kNotKept);
    written_ = false;
    ++next_;
  }
  return action;
}

}  // namespace drivers::tmcl
