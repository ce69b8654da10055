#include "drivers/station/session.h"

#include <sodium.h>

#include <algorithm>

#include "drivers/setup_error.h"
#include "drivers/station/sodium_ready.h"

namespace drivers::station {
namespace {

constexpr std::array<std::uint8_t, 4> kMagicAndVersion{'Y', 'B', 'S', 1};
constexpr std::size_t kGreetingHeaderBytes = 8;
/// For the library's key derivation: the purpose of each key.
constexpr const char* kKeyContext = "ybstatio";
enum class Purpose : std::uint64_t { kFromOperator = 1, kFromRobot = 2, kName = 3, kSession = 4 };

using Secret = std::array<std::uint8_t, 32>;
static_assert(crypto_kdf_KEYBYTES == kKeyBytes && crypto_kdf_CONTEXTBYTES == 8);
static_assert(crypto_aead_chacha20poly1305_ietf_KEYBYTES == 32);
static_assert(crypto_aead_chacha20poly1305_ietf_ABYTES == kTagBytes);
static_assert(crypto_aead_xchacha20poly1305_ietf_NPUBBYTES == 24);

Secret derived(const std::uint8_t* key, Purpose purpose) noexcept {
  Secret secret{};
  crypto_kdf_derive_from_key(secret.data(), secret.size(), static_cast<std::uint64_t>(purpose), kKeyContext,
                             key);
  return secret;
}

Purpose purpose_of(Side sender) noexcept {
  return sender == Side::kOperator ? Purpose::kFromOperator : Purpose::kFromRobot;
}

DatagramType greeting_of(Side sender) noexcept {
  return sender == Side::kOperator ? DatagramType::kHello : DatagramType::kWelcome;
}

void put_head(std::span<std::uint8_t> datagram, DatagramType type) noexcept {
  std::copy(kMagicAndVersion.begin(), kMagicAndVersion.end(), datagram.begin());
  datagram[4] = static_cast<std::uint8_t>(type);
  std::fill_n(datagram.begin() + 5, 3, std::uint8_t{0});
}

using Nonce = std::array<std::uint8_t, crypto_aead_chacha20poly1305_ietf_NPUBBYTES>;
constexpr std::size_t kSequenceAt = 16;
constexpr std::size_t kSequenceBytes = 8;

Nonce nonce_in(std::span<const std::uint8_t> datagram) noexcept {
  Nonce nonce{};
  std::copy_n(datagram.begin() + kSequenceAt, kSequenceBytes, nonce.end() - kSequenceBytes);
  return nonce;
}

}  // namespace

void require_sodium() {
  if (sodium_init() < 0)
    throw SetupError({"libsodium", "start", "a source of random numbers", "none", "check /dev/urandom"});
}

Challenge random_challenge() noexcept {
  Challenge challenge{};
  randombytes_buf(challenge.data(), challenge.size());
  return challenge;
}

bool is_datagram(std::span<const std::uint8_t> bytes, DatagramType type) noexcept {
  return bytes.size() >= 8 && std::equal(kMagicAndVersion.begin(), kMagicAndVersion.end(), bytes.begin()) &&
         bytes[4] == static_cast<std::uint8_t>(type) && bytes[5] == 0 && bytes[6] == 0 && bytes[7] == 0;
}

Session::Session(const Key& key, const Challenge& from_operator, const Challenge& from_robot,
                 Side side) noexcept {
  std::array<std::uint8_t, 2 * std::tuple_size_v<Challenge>> both{};
  std::copy(from_operator.begin(), from_operator.end(), both.begin());
  std::copy(from_robot.begin(), from_robot.end(), both.begin() + from_operator.size());
  Secret base = derived(key.data(), Purpose::kSession);
  Secret session{};
  crypto_generichash(session.data(), session.size(), both.data(), both.size(), base.data(), base.size());
  const Side other = side == Side::kOperator ? Side::kRobot : Side::kOperator;
  seal_key_ = derived(session.data(), purpose_of(side));
  open_key_ = derived(session.data(), purpose_of(other));
  const Secret name = derived(session.data(), Purpose::kName);
  std::copy_n(name.begin(), id_.size(), id_.begin());
  sodium_memzero(base.data(), base.size());
  sodium_memzero(session.data(), session.size());
}

Session::~Session() {
  sodium_memzero(seal_key_.data(), seal_key_.size());
  sodium_memzero(open_key_.data(), open_key_.size());
}

std::size_t Session::seal(std::span<const std::uint8_t> message, std::span<std::uint8_t> datagram) noexcept {
  const std::size_t size = kDatagramHeaderBytes + message.size() + kTagBytes;
  if (datagram.size() < size) return 0;
  ++sequence_;
  put_head(datagram, DatagramType::kState);
  std::copy(id_.begin(), id_.end(), datagram.begin() + 8);
  for (std::size_t i = 0; i < kSequenceBytes; ++i)
    datagram[kSequenceAt + i] = static_cast<std::uint8_t>(sequence_ >> (8 * i));
  const Nonce nonce = nonce_in(datagram);
  crypto_aead_chacha20poly1305_ietf_encrypt(datagram.data() + kDatagramHeaderBytes, nullptr, message.data(),
                                            message.size(), datagram.data(), kDatagramHeaderBytes, nullptr,
                                            nonce.data(), seal_key_.data());
  return size;
}

Session::Opened Session::open(std::span<const std::uint8_t> datagram,
                              std::span<std::uint8_t> message) noexcept {
  if (datagram.size() < kDatagramHeaderBytes + kTagBytes || !is_datagram(datagram, DatagramType::kState) ||
      !std::equal(id_.begin(), id_.end(), datagram.begin() + 8))
    return {};
  Opened opened{.bytes = datagram.size() - kDatagramHeaderBytes - kTagBytes};
  if (message.size() < opened.bytes) return {};
  for (std::size_t i = 0; i < kSequenceBytes; ++i)
    opened.sequence |= std::uint64_t{datagram[kSequenceAt + i]} << (8 * i);
  opened.verdict = Verdict::kReplayed;
  if (window_.look(opened.sequence) == ReplayWindow::Seen::kBefore) return opened;
  opened.verdict = Verdict::kForged;
  const Nonce nonce = nonce_in(datagram);
  if (crypto_aead_chacha20poly1305_ietf_decrypt(
          message.data(), nullptr, nullptr, datagram.data() + kDatagramHeaderBytes, opened.bytes + kTagBytes,
          datagram.data(), kDatagramHeaderBytes, nonce.data(), open_key_.data()) != 0)
    return opened;
  opened.verdict =
      window_.take(opened.sequence) == ReplayWindow::Seen::kNewest ? Verdict::kNewest : Verdict::kLate;
  return opened;
}

GreetingDatagram seal_greeting(const Key& key, Side sender, const Greeting& greeting) noexcept {
  GreetingDatagram datagram{};
  put_head(datagram, greeting_of(sender));
  std::uint8_t* const nonce = datagram.data() + kGreetingHeaderBytes;
  randombytes_buf(nonce, crypto_aead_xchacha20poly1305_ietf_NPUBBYTES);
  std::array<std::uint8_t, 32> plain{};
  std::copy(greeting.from_operator.begin(), greeting.from_operator.end(), plain.begin());
  std::copy(greeting.from_robot.begin(), greeting.from_robot.end(), plain.begin() + 16);
  Secret secret = derived(key.data(), purpose_of(sender));
  crypto_aead_xchacha20poly1305_ietf_encrypt(nonce + crypto_aead_xchacha20poly1305_ietf_NPUBBYTES, nullptr,
                                             plain.data(), plain.size(), datagram.data(),
                                             kGreetingHeaderBytes, nullptr, nonce, secret.data());
  sodium_memzero(secret.data(), secret.size());
  return datagram;
}

bool open_greeting(const Key& key, Side sender, std::span<const std::uint8_t> datagram,
                   Greeting& greeting) noexcept {
  if (datagram.size() != kGreetingBytes || !is_datagram(datagram, greeting_of(sender))) return false;
  const std::uint8_t* const nonce = datagram.data() + kGreetingHeaderBytes;
  const std::size_t head = kGreetingHeaderBytes + crypto_aead_xchacha20poly1305_ietf_NPUBBYTES;
  std::array<std::uint8_t, 32> plain{};
  Secret secret = derived(key.data(), purpose_of(sender));
  const bool genuine = crypto_aead_xchacha20poly1305_ietf_decrypt(
                           plain.data(), nullptr, nullptr, datagram.data() + head, datagram.size() - head,
                           datagram.data(), kGreetingHeaderBytes, nonce, secret.data()) == 0;
  sodium_memzero(secret.data(), secret.size());
  if (!genuine) return false;
  std::copy_n(plain.begin(), 16, greeting.from_operator.begin());
  std::copy_n(plain.begin() + 16, 16, greeting.from_robot.begin());
  return true;
}

}  // namespace drivers::station
