#include "apps/youbot_bench/sdo.h"

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <stdexcept>

#include "apps/youbot_bench/bus.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/sdo_client.h"
#include "runtime/program/exit_code.h"

namespace youbot_bench {
namespace {

namespace ethercat = drivers::ethercat;

enum class Kind : std::uint8_t { kUnsigned, kSigned, kReal, kText, kBytes };

struct Type {
  std::string_view name;
  Kind kind = Kind::kBytes;
  std::size_t bytes = 0;  // 0: any
};

constexpr std::array<Type, 12> kTypes{{{"uint8", Kind::kUnsigned, 1},
                                       {"uint16", Kind::kUnsigned, 2},
                                       {"uint32", Kind::kUnsigned, 4},
                                       {"uint64", Kind::kUnsigned, 8},
                                       {"int8", Kind::kSigned, 1},
                                       {"int16", Kind::kSigned, 2},
                                       {"int32", Kind::kSigned, 4},
                                       {"int64", Kind::kSigned, 8},
                                       {"float", Kind::kReal, 4},
                                       {"double", Kind::kReal, 8},
                                       {"string", Kind::kText, 0},
                                       {"bytes", Kind::kBytes, 0}}};

std::string type_names() {
  std::string names;
  for (const Type& type : kTypes) names += (names.empty() ? "" : ", ") + std::string(type.name);
  return names;
}

const Type& type_called(const std::string& name) {
  const auto* const found = std::ranges::find(kTypes, name, &Type::name);
  if (found == kTypes.end())
    throw std::invalid_argument("--type: '" + name + "' is not one of " + type_names());
  return *found;
}

[[noreturn]] void refuse(std::string_view value, std::string_view type) {
  throw std::invalid_argument(fmt::format("'{}' is not a value of type {}", value, type));
}

/// Parses all of `text`, decimal or, after 0x, hexadecimal.
template <typename Integer>
std::optional<Integer> integer(std::string_view text) {
  const bool hexadecimal = text.starts_with("0x") || text.starts_with("0X");
  if (hexadecimal) text.remove_prefix(2);
  Integer value{};
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, hexadecimal ? 16 : 10);
  if (error != std::errc() || end != text.data() + text.size() || (hexadecimal && text.starts_with('-')))
    return std::nullopt;
  return value;
}

std::vector<std::uint8_t> little_endian(std::uint64_t value, std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
  return bytes;
}

std::uint64_t from_little_endian(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) value |= std::uint64_t{bytes[i]} << (8 * i);
  return value;
}

/// Two's complement of `size` bytes.
std::int64_t signed_value(std::uint64_t value, std::size_t size) {
  const auto unused = static_cast<int>(64 - 8 * size);
  return static_cast<std::int64_t>(value << unused) >> unused;
}

std::optional<std::uint64_t> unsigned_bits(std::string_view text, std::size_t size) {
  const auto value = integer<std::uint64_t>(text);
  return value && (size == 8 || *value >> (8 * size) == 0) ? value : std::nullopt;
}

std::optional<std::uint64_t> signed_bits(std::string_view text, std::size_t size) {
  const auto value = integer<std::int64_t>(text);
  if (!value || signed_value(static_cast<std::uint64_t>(*value), size) != *value) return std::nullopt;
  return static_cast<std::uint64_t>(*value);
}

/// A double outside the range of float is not a float.
std::optional<std::uint64_t> real_bits(std::string_view text, std::size_t size) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (size == 8) return std::bit_cast<std::uint64_t>(value);
  const auto single = static_cast<float>(value);
  if (std::isfinite(value) && (!std::isfinite(single) || (value != 0 && single == 0))) return std::nullopt;
  return std::bit_cast<std::uint32_t>(single);
}

/// "01 02 ff" or "0102ff".
std::optional<std::vector<std::uint8_t>> hexadecimal(std::string_view text) {
  std::string digits(text);
  std::erase(digits, ' ');
  if (digits.size() % 2 != 0) return std::nullopt;
  std::vector<std::uint8_t> bytes(digits.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char* const begin = digits.data() + 2 * i;
    const auto [end, error] = std::from_chars(begin, begin + 2, bytes[i], 16);
    if (error != std::errc() || end != begin + 2) return std::nullopt;
  }
  return bytes;
}

std::string hexadecimal(std::span<const std::uint8_t> bytes) {
  return fmt::format("{:02x}", fmt::join(bytes, " "));
}

/// Slaves pad their strings with zeros.
std::string_view text_of(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return text.substr(0, text.find_last_not_of('\0') + 1);
}

bool printable(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= ' ' && c <= '~'; });
}

/// Possible meanings of the bytes if the type is unknown.
std::string described(std::span<const std::uint8_t> bytes) {
  std::string text =
      fmt::format("{} byte{}: {}", bytes.size(), bytes.size() == 1 ? "" : "s", hexadecimal(bytes));
  if (std::has_single_bit(bytes.size()) && bytes.size() <= 8)
    text += fmt::format(", unsigned {}", from_little_endian(bytes));
  if (const std::string_view characters = text_of(bytes); printable(characters))
    text += fmt::format(", text \"{}\"", characters);
  return text;
}

}  // namespace

ethercat::SdoObject parse_object(std::string_view text) {
  const std::size_t colon = std::min(text.find(':'), text.size());
  std::string_view index = text.substr(0, colon);
  const std::string_view subindex = text.substr(std::min(colon + 1, text.size()));
  if (index.starts_with("0x") || index.starts_with("0X")) index.remove_prefix(2);
  ethercat::SdoObject object;
  const auto read = [](std::string_view digits, auto& value) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, 16);
    return error == std::errc() && end == digits.data() + digits.size();
  };
  if (!read(index, object.index) || !read(subindex, object.subindex))
    throw std::invalid_argument(
        fmt::format("'{}' is not an object: INDEX:SUBINDEX, both hexadecimal, such as 0x1018:01", text));
  return object;
}

std::vector<std::uint8_t> sdo_bytes(const std::string& type, std::string_view value) {
  const Type& wanted = type_called(type);
  std::optional<std::uint64_t> bits;
  switch (wanted.kind) {
    case Kind::kText: return {value.begin(), value.end()};
    case Kind::kBytes:
      if (auto bytes = hexadecimal(value)) return *std::move(bytes);
      refuse(value, type);
    case Kind::kUnsigned: bits = unsigned_bits(value, wanted.bytes); break;
    case Kind::kSigned: bits = signed_bits(value, wanted.bytes); break;
    case Kind::kReal: bits = real_bits(value, wanted.bytes); break;
  }
  if (!bits) refuse(value, type);
  return little_endian(*bits, wanted.bytes);
}

std::string sdo_value(const std::string& type, std::span<const std::uint8_t> bytes) {
  const Type& wanted = type_called(type);
  if (wanted.bytes != 0 && bytes.size() != wanted.bytes)
    throw std::invalid_argument(fmt::format("--type: {} has {} bytes, the object has {}: {}", type,
                                            wanted.bytes, bytes.size(), hexadecimal(bytes)));
  const std::uint64_t bits = wanted.bytes != 0 ? from_little_endian(bytes) : 0;
  switch (wanted.kind) {
    case Kind::kUnsigned: return std::to_string(bits);
    case Kind::kSigned: return std::to_string(signed_value(bits, wanted.bytes));
    case Kind::kReal:
      return wanted.bytes == 8 ? fmt::format("{}", std::bit_cast<double>(bits))
                               : fmt::format("{}", std::bit_cast<float>(static_cast<std::uint32_t>(bits)));
    case Kind::kText:
      if (const std::string_view text = text_of(bytes); text.empty() || printable(text))
        return std::string(text);
      throw std::invalid_argument("--type: the object is not text: " + hexadecimal(bytes));
    case Kind::kBytes: break;
  }
  return hexadecimal(bytes);
}

void sdo(ethercat::Link& link, const SdoOptions& options) {
  ethercat::SdoObject object = parse_object(options.object);
  object.complete = options.complete;
  std::vector<std::uint8_t> data;
  if (options.value) {
    if (options.type.empty()) throw std::invalid_argument("--type is missing: one of " + type_names());
    data = sdo_bytes(options.type, *options.value);
  } else if (!options.type.empty()) {
    (void)type_called(options.type);
  }

  ethercat::PreOpBus bus(link, nullptr, {});
  const std::size_t count = bus.slaves().size();
  if (options.slave < 1 || static_cast<std::size_t>(options.slave) > count)
    throw std::invalid_argument(fmt::format("--slave: {} is not 1 to {}", options.slave, count));
  const auto index = static_cast<std::size_t>(options.slave) - 1;
  ethercat::SdoClient client(bus, index);
  bus.enter_pre_op();
  const std::string label = bus.slaves()[index].label() + ", " + to_string(object);
  if (options.value) {
    client.write(object, data);
    fmt::print("{}: {} written ({})\n", label, *options.value, hexadecimal(data));
  } else {
    data = client.read(object);
    if (options.type.empty())
      fmt::print("{}: {}\n", label, described(data));
    else
      fmt::print("{}\n", sdo_value(options.type, data));  // value only, for scripts
  }
  for (const ethercat::CoeEmergency& emergency : client.emergencies())
    fmt::print(stderr, "youbot-bench: {}: emergency 0x{:04X}, {}\n", bus.slaves()[index].label(),
               emergency.error_code, ethercat::describe_emergency(emergency.error_code));
}

Subcommand add_sdo(CLI::App& app) {
  const auto options = std::make_shared<SdoOptions>();
  CLI::App* const command = app.add_subcommand(
      "sdo", "read or write an object of a slave that supports CoE; takes the bus to PRE-OP");
  command->add_option("--robot", options->robot, kBusHelp)->required();
  command->add_option("--slave", options->slave, "position on the bus, from 1, as scan prints it")
      ->required();
  command->add_option("--object", options->object, "INDEX:SUBINDEX, both hexadecimal, such as 0x1018:01")
      ->required();
  command->add_option("--type", options->type,
                      type_names() + " (hexadecimal); none: print what the bytes may be");
  command->add_option("--set", options->value, "write this value, which needs --type");
  command->add_flag("--complete", options->complete, "all subindices at once, from :00 or :01 on");
  return {command, [options] {
            sdo(*open_bus(options->robot).link, *options);
            return runtime::kExitOk;
          }};
}

}  // namespace youbot_bench
