// Fault scripts, and with them the reader of all our TOML files.
#include <string_view>

#include "apps/youbot_sim/fault_file.h"
#include "runtime/configuration/toml_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

using fuzz::require;

std::vector<fuzz::Bytes> fuzz::seeds() {
  std::vector<Bytes> result;
  for (const std::string_view text :
       {"[[fault]]\nkind = \"slave_off\"\nat_s = 2.0\nduration_s = 1.5\nslave = 3\n",
        "[[fault]]\nkind = \"corrupt\"\nat_frame = 1000\ncount = 3\noffset = 0x1A\nmask = 255\n",
        "[[fault]]\nkind = \"delay\"\ndelay_s = 7e-4\n[[fault]]\nkind = \"wrong_counter\"\n"
        "counter_change = -1\ndatagram = 2\n",
        "[[fault]]\nkind = \"foreign_write\"\nat_s = 1\nslave = 2\noffset = 0x600\ncount = 16\nvalue = 0\n",
        "fault = [{ kind = \"board_fault\", board_fault = 'overvoltage' }] # comment\n"})
    result.push_back(bytes_of(text));
  return result;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::MemoryFile file;
  file.hold({data, size});
  try {
    for (const sim::bus::FaultEvent& event : youbot_sim::load_faults(file.path(), 5)) {
      require(event.kind <= sim::bus::FaultKind::kForeignWrite);
      require(event.count >= 1 && event.mask != 0);
      require(event.at.count() >= 0 && event.duration.count() >= 0 && event.delay.count() >= 0);
    }
  } catch (const runtime::ConfigError& error) {
    require(!error.problems().empty());
  }
  return 0;
}
