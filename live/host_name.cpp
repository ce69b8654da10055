#include "live/host_name.h"

#include <arpa/inet.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <climits>
#include <string>

namespace live {
namespace {

std::string lower(std::string_view text) {
  std::string small(text);
  std::ranges::transform(small, small.begin(), [](unsigned char c) { return std::tolower(c); });
  return small;
}

bool is_address(const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> address{};
  if (host.find('\0') != std::string::npos) return false;  // inet_pton would read up to it
  return inet_pton(AF_INET, host.c_str(), address.data()) == 1 ||
         inet_pton(AF_INET6, host.c_str(), address.data()) == 1;
}

std::string own_name() {
  std::array<char, HOST_NAME_MAX + 1> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? lower(name.data()) : "";
}

}  // namespace

bool names_this_machine(std::string_view host) {
  const std::size_t bracket = host.find(']');
  const bool v6 = host.starts_with('[') && bracket != std::string_view::npos;
  const std::string name = lower(v6 ? host.substr(1, bracket - 1) : host.substr(0, host.find(':')));
  if (name == "localhost" || is_address(name)) return true;
  const std::string own = own_name();
  return !own.empty() && (name == own || name == own + ".local");
}

}  // namespace live
