/// @file
/// One session between two stations: authenticated encryption by libsodium, and protection against replay.
///
/// Each session has its own keys, derived from the shared key and a random number of either side, one for
/// each direction: a datagram recorded in an earlier session, or sent back to its sender, does not open. The
/// nonce is the sequence number, which never repeats within a session.
///
/// Datagram: magic "YBS", version, type, three zeros, session (8 bytes), sequence (8 bytes, little-endian),
/// all authenticated, then ciphertext (ChaCha20) and tag (Poly1305, 16 bytes); RFC 8439.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/station/key.h"
#include "drivers/station/replay_window.h"

namespace drivers::station {

enum class Side : std::uint8_t { kOperator, kRobot };

/// A random number used once, of one side.
using Challenge = std::array<std::uint8_t, 16>;
Challenge random_challenge() noexcept;

enum class DatagramType : std::uint8_t { kHello = 1, kWelcome = 2, kState = 3 };

inline constexpr std::size_t kDatagramHeaderBytes = 24;
inline constexpr std::size_t kTagBytes = 16;

/// Type of a datagram of this version of the protocol; false for everything else.
bool is_datagram(std::span<const std::uint8_t> bytes, DatagramType type) noexcept;

/// One thread. Cycle: seal() and open(); nothing here allocates, locks or throws.
class Session {
 public:
  /// Of `side`; the other one makes the same from the same key and challenges. Needs require_sodium().
  Session(const Key& key, const Challenge& from_operator, const Challenge& from_robot, Side side) noexcept;
  Session(const Session&) = default;
  Session& operator=(const Session&) = default;
  ~Session();

  /// The next datagram of the session. Bytes written; 0 if `datagram` is too small.
  std::size_t seal(std::span<const std::uint8_t> message, std::span<std::uint8_t> datagram) noexcept;

  enum class Verdict : std::uint8_t {
    kNewest,    ///< newer than all before
    kLate,      ///< overtaken by a newer one; genuine and not seen before
    kReplayed,  ///< seen before, or too old to know
    kForeign,   ///< not of this session
    kForged,    ///< the tag does not fit
  };
  struct Opened {
    Verdict verdict = Verdict::kForeign;
    std::uint64_t sequence = 0;
    std::size_t bytes = 0;  ///< of the message
  };
  /// `message` has the plain text of the newest and of late ones, and must have room for it.
  Opened open(std::span<const std::uint8_t> datagram, std::span<std::uint8_t> message) noexcept;

  /// Number of the last datagram sealed; 0: none.
  std::uint64_t sequence() const noexcept { return sequence_; }
  const ReplayWindow& received() const noexcept { return window_; }

 private:
  std::array<std::uint8_t, 32> seal_key_{};
  std::array<std::uint8_t, 32> open_key_{};
  std::array<std::uint8_t, 8> id_{};
  std::uint64_t sequence_ = 0;
  ReplayWindow window_;
};

/// Before there is a session: two challenges in one datagram, sealed with the shared key, under a random
/// nonce. From the operator, the robot's one is zero until it is known.
struct Greeting {
  Challenge from_operator{};
  Challenge from_robot{};
};
inline constexpr std::size_t kGreetingBytes = 8 + 24 + 32 + kTagBytes;
using GreetingDatagram = std::array<std::uint8_t, kGreetingBytes>;
/// `sender` kOperator makes a kHello, kRobot a kWelcome.
GreetingDatagram seal_greeting(const Key& key, Side sender, const Greeting& greeting) noexcept;
/// False unless it is a genuine greeting of that sender.
bool open_greeting(const Key& key, Side sender, std::span<const std::uint8_t> datagram,
                   Greeting& greeting) noexcept;

}  // namespace drivers::station
