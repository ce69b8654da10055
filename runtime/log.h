/// @file
/// spdlog for calls with arguments, without compiling fmt's formatter in each file that logs: that takes 3 s.
#pragma once
#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#if FMT_VERSION < 100000  // later versions declare it
extern template void fmt::detail::vformat_to<char>(fmt::detail::buffer<char>&, fmt::string_view,
                                                   fmt::format_args, fmt::detail::locale_ref);
#endif
