#include "runtime/mcap/mcap_file.h"

#include <memory>
#include <stdexcept>

#include "runtime/configuration/regular_file.h"

namespace runtime::mcap {

ReadBytes read_file(const std::filesystem::path& path) {
  const auto named = [path](const std::runtime_error& error) {
    return ConfigError({path.string() + ": " + error.what()});
  };
  std::shared_ptr<RegularFile> file;  // a std::function can be copied
  try {
    file = std::make_shared<RegularFile>(path);
  } catch (const std::runtime_error& error) {
    throw named(error);
  }
  return [file, named](char* buffer, std::size_t size) {
    try {
      return file->read(buffer, size);
    } catch (const std::runtime_error& error) {
      throw named(error);
    }
  };
}

}  // namespace runtime::mcap
