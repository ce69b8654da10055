// Fault scripts, and with them the reader of all our TOML files.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "apps/common/toml_reader.h"
#include "apps/youbot_sim/fault_file.h"
#include "tests/fuzz/fuzz_target.h"

using fuzz::require;

std::vector<fuzz::Bytes> fuzz::seeds() {
  std::vector<Bytes> result;
  for (const std::string_view text :
       {"[[fault]]\nkind = \"slave_off\"\nat_s = 2.0\nduration_s = 1.5\nslave = 3\n",
        "[[fault]]\nkind = \"corrupt\"\nat_frame = 1000\ncount = 3\noffset = 0x1A\nmask = 255\n",
        "[[fault]]\nkind = \"delay\"\ndelay_s = 7e-4\n[[fault]]\nkind = \"wrong_counter\"\n"
        "counter_change = -1\ndatagram = 2\n",
        "fault = [{ kind = \"board_fault\", board_fault = 'overvoltage' }] # comment\n"})
    result.emplace_back(text.begin(), text.end());
  return result;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // A file in memory, the same one for all inputs.
  static const int file = memfd_create("faults", MFD_CLOEXEC);
  static const std::string path = "/proc/self/fd/" + std::to_string(file);
  require(file >= 0 && ftruncate(file, 0) == 0);
  require(pwrite(file, data, size, 0) == static_cast<ssize_t>(size));
  try {
    for (const sim::bus::FaultEvent& event : youbot_sim::load_faults(path, 5)) {
      require(event.kind <= sim::bus::FaultKind::kBoardFault);
      require(event.count >= 1 && event.mask != 0);
      require(event.at.count() >= 0 && event.duration.count() >= 0 && event.delay.count() >= 0);
    }
  } catch (const apps::ConfigError& error) {
    require(!error.problems().empty());
  }
  return 0;
}
