#include "runtime/program/control_socket.h"

#include <sys/socket.h>

#include <cstring>
#include <stdexcept>

namespace runtime {

sockaddr_un control_address(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& name = path.native();
  if (name.empty() || name.size() >= sizeof address.sun_path)
    throw std::invalid_argument(
        "control socket: '" + name + "' is " +
        (name.empty() ? "no path" : "longer than the 107 characters a socket may have"));
  std::memcpy(address.sun_path, name.c_str(), name.size() + 1);
  return address;
}

}  // namespace runtime
