/// @file
/// Requests of clients as text.
#pragma once
#include <algorithm>
#include <string_view>

namespace youbotd {

/// The first word, as Service::answer() reads it; empty if there is none.
constexpr std::string_view command_of(std::string_view request) {
  constexpr std::string_view kBlank = " \t\n\v\f\r";
  request.remove_prefix(std::min(request.find_first_not_of(kBlank), request.size()));
  return request.substr(0, request.find_first_of(kBlank));
}

}  // namespace youbotd
