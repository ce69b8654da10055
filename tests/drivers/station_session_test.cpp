// Sessions between two stations: what opens, and what a stranger on the network can do.
#include "drivers/station/session.h"

#include <gtest/gtest.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "drivers/setup_error.h"
#include "drivers/station/sodium_ready.h"
#include "tests/support/temporary_directory.h"

namespace station_session_test {

using namespace drivers::station;
using Bytes = std::vector<std::uint8_t>;

const Bytes kText{1, 2, 3, 4, 5};
Challenge challenge(std::uint8_t first) { return Challenge{first}; }
Key key(std::uint8_t first) { return Key({first}); }

struct Pair {
  Session at_operator{key(1), challenge(1), challenge(2), Side::kOperator};
  Session at_robot{key(1), challenge(1), challenge(2), Side::kRobot};
};

Bytes sealed(Session& session, const Bytes& text = kText) {
  Bytes datagram(512);
  datagram.resize(session.seal(text, datagram));
  return datagram;
}

Session::Verdict opened(Session& session, const Bytes& datagram) {
  Bytes text(512);
  return session.open(datagram, text).verdict;
}

TEST(Session, OpensWhatTheOtherSideSealed) {
  Pair pair;
  Bytes text(512);
  const Session::Opened opened = pair.at_robot.open(sealed(pair.at_operator), text);
  EXPECT_EQ(opened.verdict, Session::Verdict::kNewest);
  EXPECT_EQ(opened.sequence, 1U);
  text.resize(opened.bytes);
  EXPECT_EQ(text, kText);
  EXPECT_EQ(station_session_test::opened(pair.at_operator, sealed(pair.at_robot)), Session::Verdict::kNewest);
}

// The layout and the algorithm are public: another program with the key can open a datagram.
TEST(Session, TheCiphertextIsChaCha20Poly1305OfRfc8439) {
  Pair pair;
  const Bytes datagram = sealed(pair.at_operator);
  EXPECT_EQ(Bytes(datagram.begin(), datagram.begin() + 8), (Bytes{'Y', 'B', 'S', 1, 3, 0, 0, 0}));
  EXPECT_EQ(datagram.size(), 24 + kText.size() + 16);
  EXPECT_EQ(Bytes(datagram.begin() + 16, datagram.begin() + 24), (Bytes{1, 0, 0, 0, 0, 0, 0, 0}));

  const auto derive = [](const std::uint8_t* from, std::uint64_t purpose) {
    std::array<std::uint8_t, 32> derived{};
    crypto_kdf_derive_from_key(derived.data(), derived.size(), purpose, "ybstatio", from);
    return derived;
  };
  const Key shared = key(1);
  const auto base = derive(shared.data(), 4);
  Bytes both(32);
  both[0] = 1;
  both[16] = 2;
  std::array<std::uint8_t, 32> session{};
  crypto_generichash(session.data(), session.size(), both.data(), both.size(), base.data(), base.size());
  const auto from_operator = derive(session.data(), 1);
  const std::array<std::uint8_t, 12> nonce{0, 0, 0, 0, 1};
  Bytes text(kText.size());
  ASSERT_EQ(crypto_aead_chacha20poly1305_ietf_decrypt(text.data(), nullptr, nullptr, datagram.data() + 24,
                                                      datagram.size() - 24, datagram.data(), 24, nonce.data(),
                                                      from_operator.data()),
            0);
  EXPECT_EQ(text, kText);
}

TEST(Session, EveryChangedBitIsNoticed) {
  Pair pair;
  const Bytes datagram = sealed(pair.at_operator);
  for (std::size_t bit = 0; bit < 8 * datagram.size(); ++bit) {
    Bytes changed = datagram;
    changed[bit / 8] = static_cast<std::uint8_t>(changed[bit / 8] ^ 1U << bit % 8);
    const Session::Verdict verdict = opened(pair.at_robot, changed);
    EXPECT_TRUE(verdict == Session::Verdict::kForged || verdict == Session::Verdict::kForeign ||
                verdict == Session::Verdict::kReplayed)
        << bit;
  }
  EXPECT_EQ(opened(pair.at_robot, datagram), Session::Verdict::kNewest)
      << "forgeries do not use up its number";
}

TEST(Session, OpensNothingFromAnotherKeySessionOrDirection) {
  Pair pair;
  Session other_key(key(2), challenge(1), challenge(2), Side::kOperator);
  Session earlier(key(1), challenge(1), challenge(3), Side::kOperator);
  EXPECT_EQ(opened(pair.at_robot, sealed(other_key)), Session::Verdict::kForeign);
  EXPECT_EQ(opened(pair.at_robot, sealed(earlier)), Session::Verdict::kForeign);
  EXPECT_EQ(opened(pair.at_operator, sealed(pair.at_operator)), Session::Verdict::kForged) << "sent back";
}

TEST(Session, OpensEachDatagramOnce) {
  Pair pair;
  const Bytes first = sealed(pair.at_operator);
  const Bytes second = sealed(pair.at_operator);
  EXPECT_EQ(opened(pair.at_robot, second), Session::Verdict::kNewest);
  EXPECT_EQ(opened(pair.at_robot, first), Session::Verdict::kLate);
  EXPECT_EQ(opened(pair.at_robot, first), Session::Verdict::kReplayed);
  EXPECT_EQ(opened(pair.at_robot, second), Session::Verdict::kReplayed);
}

TEST(Session, TooOldADatagramIsAReplay) {
  Pair pair;
  const Bytes old = sealed(pair.at_operator);
  Bytes newest;
  for (int i = 0; i < 1024; ++i) newest = sealed(pair.at_operator);
  EXPECT_EQ(opened(pair.at_robot, newest), Session::Verdict::kNewest);
  EXPECT_EQ(opened(pair.at_robot, old), Session::Verdict::kReplayed);
}

TEST(Greeting, OnlyTheOtherSideOpensItWithTheSameKey) {
  require_sodium();
  const Greeting greeting{challenge(1), challenge(2)};
  const GreetingDatagram hello = seal_greeting(key(1), Side::kOperator, greeting);
  Greeting read;
  ASSERT_TRUE(open_greeting(key(1), Side::kOperator, hello, read));
  EXPECT_EQ(read.from_operator, greeting.from_operator);
  EXPECT_EQ(read.from_robot, greeting.from_robot);
  EXPECT_FALSE(open_greeting(key(2), Side::kOperator, hello, read)) << "another key";
  EXPECT_FALSE(open_greeting(key(1), Side::kRobot, hello, read)) << "of the wrong side";
  for (std::size_t i = 0; i < hello.size(); ++i) {
    GreetingDatagram changed = hello;
    changed[i] ^= 1;
    EXPECT_FALSE(open_greeting(key(1), Side::kOperator, changed, read)) << i;
  }
}

TEST(ReplayWindow, CountsWhatIsMissing) {
  ReplayWindow window;
  for (std::uint64_t i = 1; i <= 4000; ++i)
    if (i % 20 != 0) window.take(i);
  EXPECT_NEAR(window.lost_permille(), 50, 2);
  for (std::uint64_t i = 4001; i <= 8000; ++i) window.take(i);
  EXPECT_EQ(window.lost_permille(), 0U);
}

TEST(ReplayWindow, ReorderedNumbersAreNotLost) {
  ReplayWindow window;
  for (std::uint64_t block = 0; block < 40; ++block)
    for (std::uint64_t i = 100; i >= 1; --i) window.take(100 * block + i);
  EXPECT_EQ(window.lost_permille(), 0U);
}

TEST(ReplayWindow, RemembersNoNumberAfterAJump) {
  ReplayWindow window;
  for (std::uint64_t i = 1; i <= 100; ++i) window.take(i);
  EXPECT_EQ(window.take(1'000'000), ReplayWindow::Seen::kNewest);
  EXPECT_EQ(window.take(999'990), ReplayWindow::Seen::kLate);
  EXPECT_EQ(window.take(50), ReplayWindow::Seen::kBefore);
}

TEST(Repetitions, LeaveOneStateInAThousand) {
  EXPECT_EQ(repetitions_for(0, 8), 0);
  EXPECT_EQ(repetitions_for(1, 8), 0);
  EXPECT_EQ(repetitions_for(10, 8), 1);   // 1e-4
  EXPECT_EQ(repetitions_for(50, 8), 2);   // 1.25e-4
  EXPECT_EQ(repetitions_for(300, 8), 5);  // 7.3e-4
  EXPECT_EQ(repetitions_for(1000, 8), 8);
  EXPECT_EQ(repetitions_for(300, 0), 0);
}

TEST(KeyFile, IsNewRandomAndForItsOwnerOnly) {
  const support::TemporaryDirectory folder;
  make_key_file(folder / "a");
  make_key_file(folder / "b");
  struct stat status {};
  ASSERT_EQ(stat((folder / "a").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
  EXPECT_EQ(status.st_size, 32);
  const Key a = read_key_file(folder / "a");
  const Key b = read_key_file(folder / "b");
  EXPECT_FALSE(std::equal(a.data(), a.data() + kKeyBytes, b.data()));
  EXPECT_THROW(make_key_file(folder / "a"), drivers::SetupError) << "never overwritten";
}

TEST(KeyFile, EveryOtherFileIsRefusedWithItsName) {
  const support::TemporaryDirectory folder;
  const auto refused = [&](const std::string& name, const std::string& reason) {
    try {
      (void)read_key_file(folder / name);
      ADD_FAILURE() << name << " was read";
    } catch (const drivers::SetupError& error) {
      const std::string text = error.what();
      EXPECT_NE(text.find(name), std::string::npos) << text;
      EXPECT_NE(text.find(reason), std::string::npos) << text;
    }
  };
  const auto written = [&](const std::string& name, std::size_t bytes, mode_t mode) {
    std::ofstream(folder / name) << std::string(bytes, 'k');
    ASSERT_EQ(chmod((folder / name).c_str(), mode), 0);
  };
  written("short", 31, 0600);
  written("long", 33, 0600);
  written("group", 32, 0640);
  written("others", 32, 0602);
  written("good", 32, 0600);
  ASSERT_EQ(symlink((folder / "good").c_str(), (folder / "link").c_str()), 0);
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  refused("none", "--make-key");
  refused("short", "32 bytes");
  refused("long", "32 bytes");
  refused("group", "chmod 600");
  refused("others", "chmod 600");
  refused("link", "--make-key");
  refused("pipe", "regular");
  EXPECT_NO_THROW((void)read_key_file(folder / "good"));
}

}  // namespace station_session_test
