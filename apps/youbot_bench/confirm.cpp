#include "apps/youbot_bench/confirm.h"

#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <stdexcept>

namespace youbot_bench {

void confirm(const Confirmation& confirmation) {
  if (isatty(STDIN_FILENO) == 0)
    throw std::invalid_argument("--robot " + confirmation.robot + ": " + confirmation.what + ". " +
                                confirmation.otherwise);
  std::fprintf(stderr, "%s: %s. %s Type '%s': ", confirmation.robot.c_str(), confirmation.what.c_str(),
               confirmation.question.c_str(), confirmation.answer.c_str());
  std::string answer;
  std::getline(std::cin, answer);
  if (answer != confirmation.answer) throw std::invalid_argument("not confirmed; nothing was moved");
}

}  // namespace youbot_bench
