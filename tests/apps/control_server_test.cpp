// The daemon's end of the control socket, with real sockets.
#include "apps/youbotd/control_server.h"

#include <grp.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <memory>
#include <string>
#include <vector>

#include "hal/setup_error.h"
#include "runtime/program/control_socket.h"
#include "tests/support/skip.h"
#include "tests/support/temporary_directory.h"

namespace control_server_test {

using namespace std::chrono_literals;
using youbotd::ControlServer;
using youbotd::Peer;

struct Echo final : ControlServer::Listener {
  std::string answer(const Peer& peer, const std::string& request) override {
    asked.push_back(peer);
    return "you said " + request;
  }
  void gone(const Peer& peer) override { left.push_back(peer); }
  bool commands(const Peer& peer) const override { return peer.connection == commander; }
  std::vector<Peer> asked;
  std::vector<Peer> left;
  std::uint64_t commander = 0;
};

/// A caller without our client.
struct Caller {
  explicit Caller(const std::filesystem::path& path) : socket(::socket(AF_UNIX, SOCK_SEQPACKET, 0)) {
    const sockaddr_un address = runtime::control_address(path);
    connected = connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~Caller() { hang_up(); }
  void hang_up() {
    if (socket >= 0) close(socket);
    socket = -1;
  }
  bool say(const std::string& text) const {
    return send(socket, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  /// The answers so far; empty without an answer, or after a disconnect.
  std::string hear() const {
    std::array<char, 256> text{};
    const ssize_t size = recv(socket, text.data(), text.size(), MSG_DONTWAIT);
    return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "";
  }
  int socket;
  bool connected = false;
};

struct ControlServerTest : testing::Test {
  void serve(ControlServer& server) {
    for (int i = 0; i < 4; ++i) server.serve(10ms);  // a connection, then what it says
  }
  support::TemporaryDirectory folder;
  std::filesystem::path path = folder / "control";
  Echo echo;
};

TEST_F(ControlServerTest, ReportsEachRequestToItsListener) {
  ControlServer server(path, echo);
  const Caller one(path);
  const Caller other(path);
  ASSERT_TRUE(one.connected && other.connected);
  ASSERT_TRUE(one.say("status") && other.say("stop"));
  serve(server);
  EXPECT_EQ(one.hear(), "you said status");
  EXPECT_EQ(other.hear(), "you said stop");
  ASSERT_EQ(echo.asked.size(), 2U);
  EXPECT_NE(echo.asked[0].connection, echo.asked[1].connection);
  EXPECT_EQ(echo.asked[0].pid, getpid());
  EXPECT_NE(echo.asked[0].name.find(std::to_string(getpid())), std::string::npos) << echo.asked[0].name;
  EXPECT_TRUE(echo.asked[0].may_command) << "the daemon's own user";
}

TEST_F(ControlServerTest, NoticesAtOnceThatAPeerIsGone) {
  ControlServer server(path, echo);
  Caller one(path);
  const Caller other(path);
  ASSERT_TRUE(one.say("hello"));
  serve(server);
  one.hang_up();
  server.serve(1000ms);
  ASSERT_EQ(echo.left.size(), 1U);
  EXPECT_EQ(echo.left[0].connection, echo.asked[0].connection);
  ASSERT_TRUE(other.say("still here"));
  serve(server);
  EXPECT_EQ(other.hear(), "you said still here");
}

TEST_F(ControlServerTest, ConnectedClientsAreServedWhileNoOtherCanBeAccepted) {
  ControlServer server(path, echo);
  const Caller inside(path);
  serve(server);
  const Caller outside(path);  // in the queue, and a ready descriptor from now on
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit full{3, before.rlim_max};  // so that accept() fails for want of a descriptor
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &full), 0);
  std::vector<std::string> answers;
  for (int i = 0; i < 50; ++i) {
    (void)inside.say("status");
    server.serve(1h);  // returns for the request alone: the test hangs otherwise
    answers.push_back(inside.hear());
  }
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(answers, std::vector<std::string>(50, "you said status"));

  ASSERT_TRUE(outside.say("stop"));
  while (outside.hear() != "you said stop") server.serve(1h);  // accepted when there is room again
  EXPECT_TRUE(echo.left.empty());
}

TEST_F(ControlServerTest, DropsWhoSendsMoreThanARequest) {
  ControlServer server(path, echo);
  const Caller loud(path);
  ASSERT_TRUE(loud.say(std::string(runtime::kLongestRequest + 1, 'x')));
  serve(server);
  EXPECT_TRUE(echo.asked.empty());
  EXPECT_EQ(echo.left.size(), 1U);
  EXPECT_FALSE(loud.say("more"));
}

TEST_F(ControlServerTest, DoesNotWaitForACallerThatNeverReadsItsAnswers) {
  ControlServer server(path, echo);
  const Caller deaf(path);
  serve(server);
  for (int i = 0; i < 5000 && echo.left.empty(); ++i) {
    (void)send(deaf.socket, "status", 6, MSG_NOSIGNAL | MSG_DONTWAIT);
    server.serve(0ms);
  }
  EXPECT_EQ(echo.left.size(), 1U) << "its answers filled the socket";
}

TEST_F(ControlServerTest, IdleConnectionsBlockNoOtherClient) {
  ControlServer server(path, echo);
  std::vector<std::unique_ptr<Caller>> idle;
  for (int i = 0; i < 40; ++i) {
    idle.push_back(std::make_unique<Caller>(path));
    server.serve(10ms);
  }
  const Caller worried(path);
  ASSERT_TRUE(worried.say("stop"));
  serve(server);
  EXPECT_EQ(worried.hear(), "you said stop");
}

TEST_F(ControlServerTest, TheSeventeenthConnectionTakesThePlaceOfTheMostSilent) {
  ControlServer server(path, echo);
  std::vector<std::unique_ptr<Caller>> callers;
  const auto connect = [&] {
    callers.push_back(std::make_unique<Caller>(path));
    ASSERT_TRUE(callers.back()->say("hello"));
    serve(server);
  };
  for (int i = 0; i < 16; ++i) connect();
  EXPECT_TRUE(echo.left.empty());
  ASSERT_TRUE(callers.front()->say("still here"));
  serve(server);
  connect();
  ASSERT_EQ(echo.left.size(), 1U);
  EXPECT_EQ(echo.left[0].connection, echo.asked[1].connection) << "the first one has spoken since";
}

TEST_F(ControlServerTest, TheCommanderKeepsItsConnectionHoweverManyWantOne) {
  ControlServer server(path, echo);
  const Caller commander(path);
  ASSERT_TRUE(commander.say("enable"));
  serve(server);
  ASSERT_EQ(commander.hear(), "you said enable");
  echo.commander = echo.asked.back().connection;
  std::vector<std::unique_ptr<Caller>> loud;
  for (int i = 0; i < 60; ++i) {
    loud.push_back(std::make_unique<Caller>(path));
    (void)loud.back()->say("status");  // later than the commander's last word
    serve(server);
  }
  for (const Peer& peer : echo.left) EXPECT_NE(peer.connection, echo.commander);
  EXPECT_FALSE(echo.left.empty());
  ASSERT_TRUE(commander.say("alive"));
  serve(server);
  EXPECT_EQ(commander.hear(), "you said alive");
}

TEST_F(ControlServerTest, AProcessOfOneConnectionKeepsItHoweverManyAnotherHas) {
  ControlServer server(path, echo);
  const pid_t modest = fork();
  if (modest == 0) {
    const Caller caller(path);
    if (!caller.connected || !caller.say("status")) _exit(1);
    pause();  // silent from now on
  }
  for (int i = 0; i < 6000 && echo.asked.empty(); ++i) server.serve(10ms);
  std::vector<std::unique_ptr<Caller>> loud;
  for (int i = 0; i < 60; ++i) {
    loud.push_back(std::make_unique<Caller>(path));
    (void)loud.back()->say("status");
    serve(server);
  }
  EXPECT_FALSE(echo.left.empty());
  for (const Peer& peer : echo.left) EXPECT_NE(peer.pid, modest);
  kill(modest, SIGKILL);
  waitpid(modest, nullptr, 0);
}

TEST_F(ControlServerTest, ARemovedSocketIsMadeAgainAndWhoIsConnectedStays) {
  ControlServer server(path, echo);
  const Caller before(path);
  serve(server);
  std::filesystem::remove(path);
  serve(server);
  const Caller after(path);
  ASSERT_TRUE(after.connected);
  ASSERT_TRUE(before.say("alive") && after.say("stop"));
  serve(server);
  EXPECT_EQ(before.hear(), "you said alive");
  EXPECT_EQ(after.hear(), "you said stop");
  struct stat found {};
  ASSERT_EQ(stat(path.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0660U);
}

TEST_F(ControlServerTest, ASocketWhoseDirectoryIsGoneIsMadeAgainOnceThatIsBack) {
  const std::filesystem::path there = folder / "run/control";
  std::filesystem::create_directory(there.parent_path());
  ControlServer server(there, echo);
  std::filesystem::remove_all(there.parent_path());
  serve(server);
  EXPECT_FALSE(std::filesystem::exists(there));
  std::filesystem::create_directory(there.parent_path());
  for (int i = 0; i < 6000 && !std::filesystem::exists(there); ++i) server.serve(10ms);
  EXPECT_TRUE(Caller(there).connected);
}

TEST_F(ControlServerTest, IsForItsOwnerAndGroupOnly) {
  const ControlServer server(path, echo);
  struct stat found {};
  ASSERT_EQ(stat(path.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777U, 0660U);
}

TEST_F(ControlServerTest, AStrangerWhoGetsInMayNotCommand) {
  SKIP_UNLESS(geteuid() == 0, "only root can become another user");
  ControlServer server(path, echo);
  chmod(path.c_str(), 0666);
  chmod(folder.path().c_str(), 0755);
  const pid_t stranger = fork();
  if (stranger == 0) {
    constexpr unsigned kNobody = 65534;
    if (setgroups(0, nullptr) != 0 || setgid(kNobody) != 0 || setuid(kNobody) != 0) _exit(2);
    const Caller caller(path);
    _exit(caller.connected && caller.say("enable") ? 0 : 1);
  }
  int status = -1;
  waitpid(stranger, &status, 0);
  ASSERT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  serve(server);
  ASSERT_EQ(echo.asked.size(), 1U);
  EXPECT_EQ(echo.asked[0].pid, stranger);
  EXPECT_EQ(echo.asked[0].uid, 65534U);
  EXPECT_FALSE(echo.asked[0].may_command);
}

TEST_F(ControlServerTest, AMemberOfOurGroupMayCommandHoweverManyGroupsItHas) {
  SKIP_UNLESS(geteuid() == 0, "only root can become another user");
  ControlServer server(path, echo);
  chmod(path.c_str(), 0666);
  chmod(folder.path().c_str(), 0755);
  for (const bool member : {false, true}) {
    const pid_t peer = fork();
    if (peer == 0) {
      constexpr unsigned kNobody = 65534;
      std::vector<gid_t> groups(1000, kNobody);
      if (member) groups.back() = getegid();
      if (setgroups(groups.size(), groups.data()) != 0 || setgid(kNobody) != 0 || setuid(kNobody) != 0)
        _exit(2);
      const Caller caller(path);
      _exit(caller.connected && caller.say("enable") ? 0 : 1);
    }
    int status = -1;
    waitpid(peer, &status, 0);
    ASSERT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
    serve(server);
    ASSERT_FALSE(echo.asked.empty());
    EXPECT_EQ(echo.asked.back().may_command, member);
  }
}

TEST_F(ControlServerTest, ReplacesWhatADeadDaemonLeftAndNothingElse) {
  {
    const int left = socket(AF_UNIX, SOCK_SEQPACKET, 0);
    const sockaddr_un address = runtime::control_address(path);
    ASSERT_EQ(bind(left, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    close(left);
  }
  {
    ControlServer server(path, echo);
    const Caller caller(path);
    EXPECT_TRUE(caller.connected);
    EXPECT_THROW(ControlServer(path, echo), hal::SetupError) << "another process serves it";
  }
  EXPECT_FALSE(std::filesystem::exists(path));

  const int stranger = socket(AF_UNIX, SOCK_STREAM, 0);
  const sockaddr_un address = runtime::control_address(path);
  ASSERT_EQ(bind(stranger, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(listen(stranger, 1), 0);
  EXPECT_THROW(ControlServer(path, echo), hal::SetupError) << "another program serves it";
  EXPECT_TRUE(std::filesystem::exists(path));
  close(stranger);

  const std::filesystem::path file = folder.write("precious", "text");
  EXPECT_THROW(ControlServer(file, echo), hal::SetupError);
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_THROW(ControlServer(folder / "no/such/place", echo), hal::SetupError);
  EXPECT_EQ(runtime::control_address(std::string(107, 'x')).sun_path, std::string(107, 'x'));
  EXPECT_THROW(ControlServer(std::string(108, 'x'), echo), std::invalid_argument);
}

}  // namespace control_server_test
