#include "apps/youbotctl/files.h"

#include <cstdio>
#include <string>
#include <system_error>

#include "runtime/log.h"
#include "runtime/mcap/convert.h"
#include "runtime/mcap/recover.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/wording.h"

namespace youbotctl {

int convert(const std::filesystem::path& in, const std::filesystem::path& out, const std::string& joint,
            bool quiet) {
  const runtime::mcap::Converted converted = runtime::mcap::convert(in, out, joint);
  for (const std::string& warning : converted.warnings) spdlog::warn("{}", warning);
  if (!quiet)
    std::printf("%s: %llu rows, %.1f MB, %.0f %% of %s\n", out.c_str(),
                static_cast<unsigned long long>(converted.rows),
                static_cast<double>(converted.bytes_out) / 1e6,
                100 * static_cast<double>(converted.bytes_out) / static_cast<double>(converted.bytes_in),
                in.filename().c_str());
  return runtime::kExitOk;
}

int recover(const std::filesystem::path& in, const std::filesystem::path& out, bool quiet) {
  const runtime::mcap::Recovered recovered = runtime::mcap::recover(in, out);
  for (const std::string& problem : recovered.problems) spdlog::warn("{}", problem);
  if (quiet) return runtime::kExitOk;
  std::string lost;
  if (recovered.damaged_records > 0)
    lost = "; " + runtime::count_text(static_cast<long long>(recovered.damaged_records), "damaged record");
  if (recovered.torn_at) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(in, error);
    lost += fmt::format("; the file ends in a record that begins at byte {} of {}", *recovered.torn_at,
                        error ? 0 : size);
  }
  std::printf("%s: %llu messages over %.3f s%s\n", out.c_str(),
              static_cast<unsigned long long>(recovered.messages), recovered.duration_s,
              lost.empty() ? "; nothing was lost" : lost.c_str());
  return runtime::kExitOk;
}

}  // namespace youbotctl
