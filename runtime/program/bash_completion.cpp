#include "runtime/program/bash_completion.h"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace runtime {
namespace {

// The parts of the function that are the same for every program.
constexpr const char* kBegin = R"(() {
  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}
  local command='' words='' word
)";
constexpr const char* kOtherwise = R"(    *)
      case $command:$current in
)";
constexpr const char* kEnd = R"(      esac ;;
  esac
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
}
)";

void append(std::string& list, const std::string& separator, const std::string& word) {
  list += (list.empty() ? "" : separator) + word;
}

/// "TEXT:{arm,base}" is how the library describes a value that is one of a list; empty for any other.
std::string values(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{');
  if (begin == type.npos) return {};
  std::string words = type.substr(begin + 1, type.find('}') - begin - 1);
  std::ranges::replace(words, ',', ' ');
  return words;
}

/// Arms of two `case` by "COMMAND:WORD": what follows an option with a value, and what else there is.
struct Arms {
  std::string after_option;
  std::string otherwise;
};

void add(Arms& arms, const std::string& command, const CLI::App& app) {
  std::string names;
  std::string files;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      append(names, " ", "--" + name);
      if (option->get_expected_max() == 0) continue;  // a flag
      const std::string pattern = command + ":--" + name;
      if (const std::string words = values(*option); !words.empty())
        arms.after_option += "    " + pattern + ") words='" + words + "' ;;\n";
      else
        append(files, " | ", pattern);
    }
  }
  if (!files.empty()) arms.after_option += "    " + files + ") ;;\n";
  arms.otherwise += "        " + command + ":-*) words='" + names + "' ;;\n";
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  const std::string& program = app.get_name();
  std::string function = "_" + program;
  std::ranges::replace(function, '-', '_');

  Arms arms;
  add(arms, "", app);
  std::string commands;
  std::string command_pattern;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    append(commands, " ", command->get_name());
    append(command_pattern, " | ", command->get_name());
    add(arms, command->get_name(), *command);
  }
  std::string find_command;
  if (!commands.empty()) {
    arms.otherwise += "        :*) words='" + commands + "' ;;\n";
    find_command = "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n    case $word in\n      " +
                   command_pattern + ") command=$word; break ;;\n    esac\n  done\n";
  }
  return "# Completes " + program + " in bash. Generated from its options.\n" + function + kBegin +
         find_command + "  case $command:$previous in\n" + arms.after_option + kOtherwise + arms.otherwise +
         kEnd + "complete -o default -F " + function + " " + program + "\n";
}

}  // namespace runtime
