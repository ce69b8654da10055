#include "runtime/program/run_app.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/configuration/toml_reader.h"
#include "runtime/program/bash_completion.h"
#include "runtime/program/build_info.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/log_pattern.h"
#include "runtime/program/manual_page.h"

namespace runtime {
namespace {

/// For a misspelled command, the library only reports that a command is missing.
std::optional<CLI::RequiredError> unknown_command(const CLI::App& app) {
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  const std::vector<std::string> left_over = app.remaining();
  if (commands.empty() || !app.get_subcommands().empty() || left_over.empty() ||
      left_over.front().starts_with('-'))
    return std::nullopt;
  std::string names;
  for (const CLI::App* command : commands) names += (names.empty() ? "" : ", ") + command->get_name();
  return CLI::RequiredError("There is no command '" + left_over.front() + "' but " + names,
                            CLI::ExitCodes::RequiredError);
}

/// What the installation asks of each program: `--generate man` and `--generate bash-completion`. Not an
/// option of the library, which would leave an empty group in --help.
std::optional<std::string> generated(const CLI::App& app, int argc, char** argv) {
  if (argc != 3 || std::string_view(argv[1]) != "--generate") return std::nullopt;
  const std::string_view what = argv[2];
  if (what == "man") return manual_page(app);
  if (what == "bash-completion") return bash_completion(app);
  return std::nullopt;
}

}  // namespace

int run_app(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  app.set_version_flag("--version", build_version());
  if (const auto text = generated(app, argc, argv)) {
    std::fputs(text->c_str(), stdout);
    return kExitOk;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::RequiredError& error) {
    if (const auto unknown = unknown_command(app)) return app.exit(*unknown) == 0 ? kExitOk : kExitUsage;
    // A misspelled option is reported before the one that is missing because of it.
    const std::vector<std::string> left_over = app.remaining(/*recurse=*/true);
    if (!left_over.empty()) return app.exit(CLI::ExtrasError(left_over)) == 0 ? kExitOk : kExitUsage;
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kExitOk : kExitUsage;
  }
  // https://no-color.org; on a terminal the library uses colours by default.
  const char* const no_color = std::getenv("NO_COLOR");
  const bool plain = no_color != nullptr && *no_color != '\0';
  spdlog::set_default_logger(plain ? spdlog::stderr_logger_st(app.get_name())
                                   : spdlog::stderr_color_st(app.get_name()));
  spdlog::set_pattern(kLogPattern);
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

}  // namespace runtime
