// Text from outside, as terminals and logs get it.
#include "runtime/program/printable.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace printable_test {

using namespace std::string_view_literals;
using runtime::printable;

TEST(Printable, TextStaysAsItIs) {
  for (const std::string_view text : {"", "limits.force_N = 4", "Geschwindigkeit für 手 🤖", "a\tb\nc"})
    EXPECT_EQ(printable(text), text);
  EXPECT_TRUE(runtime::is_utf8("手\x1b")) << "a control character is UTF-8";
  EXPECT_FALSE(runtime::is_utf8("手\xff"));
}

TEST(Printable, ControlCharactersAreNamed) {
  EXPECT_EQ(printable("\x1b[2J\r\b\0\x7f"sv), R"(\x1b[2J\x0d\x08\x00\x7f)");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            R"(\xc2\x9b31m)")
      << "U+009B is CSI, as ESC [";
  EXPECT_EQ(printable("\xc2\xa0"), "\xc2\xa0") << "U+00A0 is no control character";
}

TEST(Printable, BytesThatAreNoUtf8AreNamed) {
  EXPECT_EQ(printable("a\xff\xfe!"), R"(a\xff\xfe!)");
  EXPECT_EQ(printable("\x9b"), R"(\x9b)");
  EXPECT_EQ(printable("\xc3"), R"(\xc3)") << "torn";
  EXPECT_EQ(printable("\xe6\x89x"), R"(\xe6\x89x)") << "torn";
  EXPECT_EQ(printable("\xc0\xaf\xe0\x80\xaf\xf0\x80\x80\xaf"), R"(\xc0\xaf\xe0\x80\xaf\xf0\x80\x80\xaf)")
      << "overlong";
  EXPECT_EQ(printable("\xed\xa0\x80"), R"(\xed\xa0\x80)") << "a surrogate";
  EXPECT_EQ(printable("\xf4\x90\x80\x80\xf5\x80\x80\x80"), R"(\xf4\x90\x80\x80\xf5\x80\x80\x80)")
      << "above U+10FFFF";
}

TEST(Printable, WhatIsNoCharacterIsNamed) {
  EXPECT_EQ(printable("\xef\xbf\xbe\xef\xbf\xbf"), R"(\xef\xbf\xbe\xef\xbf\xbf)") << "U+FFFE, U+FFFF";
  EXPECT_EQ(printable("\xef\xbf\xbd"), "\xef\xbf\xbd") << "U+FFFD";
}

TEST(Printable, AnEntryOfALogCannotBeginAnother) {
  EXPECT_EQ(runtime::printable_entry("no\nyoubotd: info: run 3 enabled"),
            "no\n  youbotd: info: run 3 enabled");
}

}  // namespace printable_test
