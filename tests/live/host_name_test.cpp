#include "live/host_name.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string>

namespace host_name_test {

using live::names_this_machine;

TEST(HostName, AddressesAndLocalhostNameThisMachine) {
  for (const char* host :
       {"localhost", "localhost:8080", "LocalHost:80", "127.0.0.1", "127.0.0.1:8080", "192.168.0.10:8080",
        "[::1]", "[::1]:8080", "[fe80::1]:80", "[::ffff:127.0.0.1]:80"})
    EXPECT_TRUE(names_this_machine(host)) << host;
}

TEST(HostName, ItsOwnNameDoesToo) {
  std::array<char, 256> name{};
  ASSERT_EQ(gethostname(name.data(), name.size() - 1), 0);
  EXPECT_TRUE(names_this_machine(name.data()));
  EXPECT_TRUE(names_this_machine(std::string(name.data()) + ":8080"));
  EXPECT_TRUE(names_this_machine(std::string(name.data()) + ".local:8080"));
  EXPECT_FALSE(names_this_machine(std::string(name.data()) + ".evil.example"));
}

TEST(HostName, NoOtherNameDoes) {
  for (const char* host : {"",
                           ":",
                           ":8080",
                           "evil.example",
                           "evil.example:8080",
                           "localhost.evil.example",
                           "127.0.0.1.evil.example",
                           "127.0.0.1.evil.example:80",
                           "127.1",
                           "0x7f000001",
                           "2130706433",
                           "[",
                           "[]",
                           "[::1",
                           "[evil.example]",
                           "::1]",
                           "]",
                           " localhost",
                           "localhost\t",
                           "127.0.0.1 evil.example"})
    EXPECT_FALSE(names_this_machine(host)) << host;
  EXPECT_FALSE(names_this_machine(std::string("localhost\0evil.example", 22)));
  EXPECT_FALSE(names_this_machine(std::string("127.0.0.1\0.evil.example", 23)));
}

}  // namespace host_name_test
