// bench_table FILE: prints the figures that the benchmarks appended to FILE as one aligned Markdown table,
// below the machine and the commit.
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/program/build_info.h"

namespace {

using Row = std::array<std::string, 3>;

/// The first such entry of /proc/cpuinfo; empty where the processor's kind has none.
std::string processor_entry(const std::string& name) {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with(name))
      if (const std::size_t colon = line.find(": "); colon != std::string::npos)
        return line.substr(colon + 2);
  return {};
}

std::string machine_text() {
  utsname system{};
  uname(&system);
  std::string processor = processor_entry("model name");
  if (processor.empty()) processor = system.machine;
  const bool is_virtual = (processor_entry("flags") + " ").find(" hypervisor ") != std::string::npos;
#ifdef __clang__
  const std::string compiler = "clang " __clang_version__;
#else
  const std::string compiler = "g++ " __VERSION__;
#endif
  return processor + ", " + std::to_string(sysconf(_SC_NPROCESSORS_ONLN)) + " cores" +
         (is_virtual ? " of a virtual machine" : "") + "; " + system.sysname + " " + system.release + "; " +
         compiler + "; youbot-hal " + runtime::build_version();
}

/// Of UTF-8, as a terminal shows it.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

std::vector<Row> read_rows(std::istream& file) {
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    std::istringstream cells(line);
    Row& row = rows.emplace_back();
    for (std::string& cell : row) std::getline(cells, cell, '\t');
  }
  return rows;
}

void print_row(const Row& row, const std::array<std::size_t, 3>& widths) {
  for (std::size_t i = 0; i < row.size(); ++i)
    std::printf("| %s%*s ", row[i].c_str(), static_cast<int>(widths[i] - width_of(row[i])), "");
  std::puts("|");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: bench_table FILE, to which the benchmarks added their figures\n", stderr);
    return 2;
  }
  if (std::string_view(argv[1]) == "--help") {
    std::puts("usage: bench_table FILE\nmakes one table of the figures that the benchmarks added to FILE");
    return 0;
  }
  std::ifstream file(argv[1]);
  std::vector<Row> rows = read_rows(file);
  if (rows.empty()) {
    std::fprintf(stderr, "bench_table: %s: no figures\n", argv[1]);
    return 2;
  }
  rows.insert(rows.begin(), {"what", "figure", "how"});
  std::array<std::size_t, 3> widths{};
  for (const Row& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], width_of(row[i]));
  std::array<std::string, 3> rule;
  for (std::size_t i = 0; i < rule.size(); ++i) rule[i].assign(widths[i], '-');
  rows.insert(rows.begin() + 1, rule);

  std::printf("%s\n\n", machine_text().c_str());
  for (const Row& row : rows) print_row(row, widths);
}
