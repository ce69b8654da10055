/// @file
/// `youbot-bench sdo`: reads or writes one object of a CoE slave.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/youbot_bench/subcommand.h"
#include "drivers/ethercat/coe_sdo.h"
#include "drivers/ethercat/link.h"

namespace youbot_bench {

struct SdoOptions {
  std::string robot{};
  int slave = 0;         ///< position on the bus, from 1
  std::string object{};  ///< "0x1018:01"
  bool complete = false;
  std::string type{};                  ///< uint8 … bytes; empty: guessed from the bytes, for reading only
  std::optional<std::string> value{};  ///< value to write; empty: read the object
};

/// "0x1018:01", both parts hexadecimal. @throws std::invalid_argument.
drivers::ethercat::SdoObject parse_object(std::string_view text);

/// Converts a value of this type to bytes, little-endian as in CoE (ETG.1000.6, section 5.6.2), and back.
/// @throws std::invalid_argument for a type, a value or a size that does not fit.
std::vector<std::uint8_t> sdo_bytes(const std::string& type, std::string_view value);
std::string sdo_value(const std::string& type, std::span<const std::uint8_t> bytes);

/// Takes the bus to PRE-OP and prints the object, or what was written to it.
/// @throws std::invalid_argument for invalid options, drivers::ethercat::BusError with the text of the abort
/// code.
void sdo(drivers::ethercat::Link& link, const SdoOptions& options);

Subcommand add_sdo(CLI::App& app);

}  // namespace youbot_bench
