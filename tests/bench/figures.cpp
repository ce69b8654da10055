#include "tests/bench/figures.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

namespace bench {

void add_figure(const std::string& what, const std::string& figure, const std::string& how) {
  const char* const path = std::getenv(kFiguresVariable);
  if (path == nullptr) return;
  std::ofstream file(path, std::ios::app);
  file << what << '\t' << figure << '\t' << how << '\n';
  file.close();
  if (!file)
    throw std::runtime_error(std::string(path) + ": cannot be written; " + kFiguresVariable + " names it");
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), value < 100 ? "%.3g" : "%.0f", value);
  return text.data();
}

std::string quantiles_text(double median_us, double p99_9_us) {
  return number_text(median_us) + " µs median, " + number_text(p99_9_us) + " µs 99.9 %";
}

std::string quantiles_text(const drivers::LatencyHistogram& histogram) {
  const auto microseconds = [&](double fraction) {
    return std::chrono::duration<double, std::micro>(histogram.quantile(fraction)).count();
  };
  return quantiles_text(microseconds(0.5), microseconds(0.999));
}

}  // namespace bench
