#include "apps/common/run_app.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <exception>
#include <stdexcept>

#include "apps/common/build_info.h"
#include "apps/common/exit_code.h"
#include "apps/common/toml_reader.h"

namespace apps {

int run_app(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  app.set_version_flag("--version", build_version());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  }
  spdlog::set_default_logger(spdlog::stderr_color_st(app.get_name()));
  spdlog::set_pattern("%n: %^%l%$: %v");
  try {
    return body();
  } catch (const ConfigError& error) {
    for (const std::string& problem : error.problems()) spdlog::error("{}", problem);
    return kExitUsage;
  } catch (const std::invalid_argument& error) {
    spdlog::error("{}", error.what());
    return kExitUsage;
  } catch (const std::exception& error) {
    spdlog::error("{}", error.what());
    return kExitSetup;
  }
}

}  // namespace apps
