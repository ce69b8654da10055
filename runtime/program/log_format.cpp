#include "runtime/program/log_format.h"

#include <spdlog/details/log_msg.h>
#include <spdlog/pattern_formatter.h>

#include <string>
#include <string_view>
#include <utility>

#include "runtime/program/printable.h"

namespace runtime {
namespace {

class LogFormat final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& line) override {
    const std::string text =
        printable_entry(std::string_view(message.payload.data(), message.payload.size()));
    spdlog::details::log_msg shown = message;
    shown.payload = text;
    pattern_.format(shown, line);
    message.color_range_start = shown.color_range_start;
    message.color_range_end = shown.color_range_end;
  }
  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<LogFormat>(); }

 private:
  spdlog::pattern_formatter pattern_{"%n: %^%l%$: %v"};
};

}  // namespace

std::unique_ptr<spdlog::formatter> log_format() { return std::make_unique<LogFormat>(); }

}  // namespace runtime
