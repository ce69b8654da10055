#include "runtime/program/manual_page.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <string_view>

#include "runtime/program/build_info.h"

namespace runtime {
namespace {

/// What roff prints as `text`. A hyphen stays the character that a shell knows, so that options can be
/// copied.
std::string roff(std::string_view text) {
  std::string escaped = text.starts_with('.') ? "\\&" : "";  // else a request
  for (const char c : text) {
    switch (c) {
      case '\\': escaped += "\\e"; break;
      case '-': escaped += "\\-"; break;
      case '\'': escaped += "\\(aq"; break;
      case '`': escaped += "\\(ga"; break;
      case '^': escaped += "\\(ha"; break;
      case '~': escaped += "\\(ti"; break;
      case '\n': escaped += "\n.br\n\\&"; break;  // whatever the line begins with
      default: escaped += c;
    }
  }
  return escaped;
}

std::string paragraph(const std::string& text) { return text.empty() ? "" : ".PP\n" + roff(text) + "\n"; }

/// A list of one option or command each, described beside it.
std::string item(const std::string& name, const std::string& value, const std::string& description) {
  return ".TP\n\\fB" + roff(name) + "\\fR" + roff(value) + "\n" + roff(description) + "\n";
}

std::string options(const CLI::App& app) {
  const CLI::Formatter help;
  std::string text;
  // Each command has --help: printed once, for the program.
  const CLI::Option* const left_out = app.get_parent() == nullptr ? nullptr : app.get_help_ptr();
  for (const CLI::Option* option : app.get_options([&](const CLI::Option* one) { return one != left_out; }))
    text += item(help.make_option_name(option, option->get_positional()), help.make_option_opts(option),
                 option->get_description());
  return text;
}

std::string usage(const CLI::App& app, const std::string& name) {
  std::string line = CLI::Formatter().make_usage(&app, name);
  constexpr std::string_view kHeading = "Usage: ";
  line.erase(0, kHeading.size());
  line.pop_back();  // the end of the line
  return line;
}

/// apropos(1) shows it in one line behind the name.
std::string summary(const CLI::App& app) {
  std::string text = app.get_description();
  text.resize(std::min(text.find(". "), text.size()));
  if (text.ends_with('.')) text.pop_back();
  if (!text.empty()) text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

std::string heading(const std::string& name) {
  std::string upper = name;
  std::ranges::transform(upper, upper.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  // Ragged and without hyphenation: an option is not to be broken.
  return ".TH " + roff(upper) + R"( 1 "" "youbot\-hal )" + roff(build_version()) + R"(" "User Commands")" +
         "\n.nh\n.ad l\n";
}

}  // namespace

std::string manual_page(const CLI::App& app) {
  const std::string& name = app.get_name();
  std::string page = heading(name) + ".SH NAME\n" + roff(name) + " \\- " + roff(summary(app)) +
                     "\n.SH SYNOPSIS\n" + roff(usage(app, name)) + "\n.SH DESCRIPTION\n" +
                     roff(app.get_description()) + "\n.SH OPTIONS\n" + options(app);
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  if (!commands.empty()) page += ".SH COMMANDS\n";
  for (const CLI::App* command : commands) {
    page += ".SS " + roff(usage(*command, name + " " + command->get_name())) + "\n" +
            roff(command->get_description()) + "\n" + options(*command);
    // A command without one of its own inherits the program's.
    if (command->get_footer() != app.get_footer()) page += paragraph(command->get_footer());
  }
  if (!app.get_footer().empty()) page += ".SH NOTES\n" + roff(app.get_footer()) + "\n";
  return page;
}

}  // namespace runtime
