/// @file
/// The secret that two stations share.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace drivers::station {

inline constexpr std::size_t kKeyBytes = 32;

/// Overwritten with zeros when it is destroyed.
class Key {
 public:
  explicit Key(const std::array<std::uint8_t, kKeyBytes>& bytes) noexcept : bytes_(bytes) {}
  Key(const Key&) = default;
  Key& operator=(const Key&) = default;
  ~Key();
  const std::uint8_t* data() const noexcept { return bytes_.data(); }

 private:
  std::array<std::uint8_t, kKeyBytes> bytes_;
};

/// Setup: writes 32 random bytes into a new file that only its owner can read.
/// @throws SetupError naming the file, also if it exists.
void make_key_file(const std::filesystem::path& path);

/// Setup: the key in a file of make_key_file().
/// @throws SetupError naming the file, unless it is a regular file of this user that no other user can read
/// or write, with 32 bytes.
Key read_key_file(const std::filesystem::path& path);

}  // namespace drivers::station
