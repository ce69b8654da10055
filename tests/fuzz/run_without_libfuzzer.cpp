// Stands in for libFuzzer where that is missing: mutations of the target's seeds, the same in every run.
//   fuzz_frame [RUNS [SEED]]      mutated inputs (default 200000, 1)
//   fuzz_frame --file INPUT...    these inputs: what libFuzzer or a failed run left
//   fuzz_frame --seeds FOLDER     writes the seeds, to start libFuzzer from
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <string_view>

#include "tests/fuzz/fuzz_target.h"

/// Sanitizers end the process without a signal.
// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" void __sanitizer_set_death_callback(void (*callback)()) __attribute__((weak));

namespace {

using fuzz::Bytes;

const Bytes* input_under_test = nullptr;

/// Whatever ends us: leave the input behind. Only calls that signal handlers may make.
void leave_input() {
  if (input_under_test == nullptr) return;
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::array<char, 2> hex{};
  const auto print = [](std::string_view text) { (void)!write(STDERR_FILENO, text.data(), text.size()); };
  print("failing input: ");
  for (const std::uint8_t byte : *input_under_test) {
    hex = {kDigits[byte >> 4], kDigits[byte & 15]};
    print({hex.data(), hex.size()});
  }
  print("  (make a file of it with xxd -r -p)\n");
}

void on_signal(int signal) {
  leave_input();
  std::signal(signal, SIG_DFL);
  (void)raise(signal);
}

void run(const Bytes& input) {
  const Bytes exact(input);  // no spare capacity, so that the address sanitizer sees its end
  input_under_test = &exact;
  (void)LLVMFuzzerTestOneInput(exact.data(), exact.size());
  input_under_test = nullptr;
}

class Mutator {
 public:
  explicit Mutator(std::uint32_t seed) : random_(seed), seeds_(fuzz::seeds()) {}

  Bytes next() {
    if (below(16) == 0) {  // noise
      Bytes noise(below(64));
      std::ranges::generate(noise, [this] { return byte(); });
      return noise;
    }
    Bytes input = seeds_[below(seeds_.size())];
    for (std::size_t left = below(6); left > 0 && !input.empty(); --left) mutate(input);
    return input;
  }

 private:
  std::size_t below(std::size_t limit) { return static_cast<std::size_t>(random_() % limit); }
  std::uint8_t byte() { return static_cast<std::uint8_t>(random_()); }

  void mutate(Bytes& input) {
    // Headers come first: half of the mutations change them.
    const std::size_t reach = below(2) == 0 ? std::min<std::size_t>(input.size(), 40) : input.size();
    const std::size_t at = below(reach);
    const auto place = input.begin() + static_cast<std::ptrdiff_t>(at);
    constexpr std::array<std::uint8_t, 8> kEdges{0x00, 0x01, 0x07, 0x7F, 0x80, 0xFE, 0xFF, 0x10};
    switch (below(7)) {
      case 0: *place = byte(); break;
      case 1: *place = static_cast<std::uint8_t>(*place ^ 1U << below(8)); break;
      case 2: *place = kEdges[below(kEdges.size())]; break;
      case 3: *place = static_cast<std::uint8_t>(*place + (below(2) == 0 ? 1 : -1)); break;
      case 4: input.resize(at); break;
      case 5: input.insert(place, 1 + below(8), byte()); break;
      default: {
        const Bytes& other = seeds_[below(seeds_.size())];
        const std::size_t from = below(other.size());
        input.resize(at);
        input.insert(input.end(), other.begin() + static_cast<std::ptrdiff_t>(from), other.end());
      }
    }
  }

  std::mt19937 random_;
  std::vector<Bytes> seeds_;
};

int write_seeds(const std::string& folder) {
  int number = 0;
  for (const Bytes& seed : fuzz::seeds()) {
    std::ofstream file(folder + "/seed" + std::to_string(number++), std::ios::binary);
    file.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
    if (!file.flush()) return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}

int run_files(std::span<char*> paths) {
  for (const char* const path : paths) {
    std::ifstream file(path, std::ios::binary);
    if (!file) {
      std::fprintf(stderr, "%s: cannot be read\n", path);
      return EXIT_FAILURE;
    }
    run(Bytes(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()));
  }
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) std::signal(signal, on_signal);
  if (__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(leave_input);

  const std::string_view first = argc > 1 ? argv[1] : "";
  if (first == "--seeds" && argc == 3) return write_seeds(argv[2]);
  if (first == "--file") return run_files(std::span(argv + 2, argv + argc));

  const unsigned long runs = argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 200'000;
  const unsigned long seed = argc > 2 ? std::strtoul(argv[2], nullptr, 10) : 1;
  unsigned long done = 0;
  const auto once = [&done](const Bytes& input) {
    run(input);
    ++done;
  };
  for (const Bytes& valid : fuzz::seeds()) {  // each as it is, then every prefix
    once(valid);
    for (std::size_t size = 0; size < valid.size(); ++size)
      once(Bytes(valid.begin(), valid.begin() + static_cast<std::ptrdiff_t>(size)));
  }
  Mutator mutator(static_cast<std::uint32_t>(seed));
  for (unsigned long i = 0; i < runs; ++i) once(mutator.next());
  std::printf("%lu inputs, seed %lu\n", done, seed);
  return EXIT_SUCCESS;
}
