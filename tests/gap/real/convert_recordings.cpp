// Real recordings as youbot-gap reads them: convert_recordings tests/data DIR_OUT, then
//   youbot-gap --model DIR_OUT/NAME/base.toml --data DIR_OUT/NAME/data --out DIR
// with --held-out DIR_OUT/NAME/held_out where there is one.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "runtime/program/exit_code.h"
#include "runtime/program/run_app.h"
#include "tests/gap/real/converted_drive.h"

int main(int argc, char** argv) {
  CLI::App app("Converts the published recordings of tests/data to recordings and base models.",
               "convert_recordings");
  std::filesystem::path from;
  std::filesystem::path to;
  app.add_option("DIR_IN", from, "tests/data")->required()->check(CLI::ExistingDirectory);
  app.add_option("DIR_OUT", to, "one directory for each drive is made in it")->required();
  return runtime::run_app(app, argc, argv, [&] {
    for (const auto& drive : real_recordings::converted_drives(from)) {
      real_recordings::write_drive(drive, to / drive.base.name);
      std::printf("%s: %zu recordings, %zu held out\n", (to / drive.base.name).c_str(), drive.data.size(),
                  drive.held_out.size());
    }
    return runtime::kExitOk;
  });
}
