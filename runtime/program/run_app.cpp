#include "runtime/program/run_app.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/configuration/closest_name.h"
#include "runtime/configuration/toml_reader.h"
#include "runtime/log.h"
#include "runtime/program/bash_completion.h"
#include "runtime/program/build_info.h"
#include "runtime/program/exit_code.h"
#include "runtime/program/log_format.h"
#include "runtime/program/manual_page.h"

namespace runtime {
namespace {

/// "; did you mean 'NAME'?", if one is close.
std::string suggestion(const std::string& given, const Names& names) {
  const auto name = likely_meant(given, names);
  return name ? "; did you mean '" + *name + "'?" : "";
}

/// The command that was given, or the program if none was.
const CLI::App& given_command(const CLI::App& app) {
  const auto commands = app.get_subcommands();
  return commands.empty() ? app : given_command(*commands.front());
}

/// For a path where a command or nothing was expected: most often one more value after an option with one.
std::string path_hint(const std::string& given) {
  std::error_code unreadable;
  return std::filesystem::exists(given, unreadable) ? "; to give it to an option, write the option before it"
                                                    : "";
}

/// For a misspelled command, the library only reports that a command is missing.
std::optional<CLI::ExtrasError> unknown_command(const CLI::App& app) {
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  const std::vector<std::string> left_over = app.remaining();
  if (commands.empty() || !app.get_subcommands().empty() || left_over.empty() ||
      left_over.front().starts_with('-'))
    return std::nullopt;
  Names names;
  std::string list;
  for (const CLI::App* command : commands) {
    names.insert(command->get_name());
    list += (list.empty() ? "" : ", ") + command->get_name();
  }
  const std::string& given = left_over.front();
  return CLI::ExtrasError("There is no command '" + given + "'" + suggestion(given, names) +
                              path_hint(given) + "\nCommands: " + list,
                          CLI::ExitCodes::ExtrasError);
}

/// The first argument that neither the program nor its command knows. It is reported before the option that
/// is missing because of it.
std::optional<CLI::ExtrasError> unknown_argument(const CLI::App& app) {
  const std::vector<std::string> left_over = app.remaining(/*recurse=*/true);
  if (left_over.empty()) return std::nullopt;
  const std::string given = left_over.front().substr(0, left_over.front().find('='));
  if (!given.starts_with('-'))
    return CLI::ExtrasError("The argument '" + given + "' is not expected" + path_hint(given),
                            CLI::ExitCodes::ExtrasError);
  Names names;
  for (const CLI::App* at : {&app, &given_command(app)})
    for (const CLI::Option* option : at->get_options())
      for (const std::string& name : option->get_lnames()) names.insert("--" + name);
  return CLI::ExtrasError("There is no option '" + given + "'" + suggestion(given, names),
                          CLI::ExitCodes::ExtrasError);
}

/// A path or name that is empty, most often an unset variable of a shell, would be reported without its
/// option.
void refuse_empty(const CLI::App& app) {
  for (const CLI::App* at : {&app, &given_command(app)})
    for (const CLI::Option* option : at->get_options())
      if (!option->get_lnames().empty() && option->count() > 0 && option->get_items_expected_min() > 0)
        for (const std::string& value : option->results())
          if (value.empty()) throw CLI::ValidationError(option->get_name() + " is empty");
}

int exit_code(const CLI::App& app, const CLI::ParseError& error) {
  return app.exit(error) == 0 ? kExitOk : kExitUsage;
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
    // Options of the program may also follow its command, unless that takes whatever follows.
    for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; }))
      command->fallthrough(!command->get_prefix_command());
    app.parse(argc, argv);
    refuse_empty(app);
  } catch (const CLI::ParseError& error) {
    if (const auto code = static_cast<CLI::ExitCodes>(error.get_exit_code());
        code == CLI::ExitCodes::RequiredError || code == CLI::ExitCodes::ExtrasError) {
      if (const auto unknown = unknown_command(app)) return exit_code(app, *unknown);
      if (const auto unknown = unknown_argument(app)) return exit_code(app, *unknown);
    }
    return exit_code(app, error);
  }
  // https://no-color.org; on a terminal the library uses colours by default.
  const char* const no_color = std::getenv("NO_COLOR");
  const bool plain = no_color != nullptr && *no_color != '\0';
  spdlog::set_default_logger(plain ? spdlog::stderr_logger_st(app.get_name())
                                   : spdlog::stderr_color_st(app.get_name()));
  spdlog::set_formatter(log_format());
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
