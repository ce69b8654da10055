/// @file
#pragma once
#include <string_view>

namespace live {

/// Whether the Host header of a request names this machine: a numeric address, "localhost" or the machine's
/// host name (also with ".local"), with or without a port. Any other name was given to this address by a site
/// that wants to reach it from a browser (DNS rebinding).
bool names_this_machine(std::string_view host);

}  // namespace live
