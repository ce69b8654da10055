// Numbers in sentences: as few digits as show what they state.
#include "runtime/program/wording.h"

#include <gtest/gtest.h>

#include <string>

namespace wording_test {

std::string text_of(double value, double lower, double upper) {
  const runtime::IntervalText text = runtime::interval_text(value, lower, upper);
  return text.value + " (" + text.lower + " to " + text.upper + ")" + (text.more_digits ? " more" : "");
}

TEST(Wording, AnIntervalHasAsManyDigitsAsItTakesToSeeIt) {
  EXPECT_EQ(text_of(0.0831234, 0.0812345, 0.0853456), "0.0831 (0.08123 to 0.08535)");
  EXPECT_EQ(text_of(-200.0013, -200.0021, -200.0005), "-200.0013 (-200.0021 to -200.0005) more");
  EXPECT_EQ(text_of(1.2345671, 1.2345670, 1.2345672), "1.2345671 (1.234567 to 1.2345672) more");
  // The value lies between its bounds.
  EXPECT_EQ(text_of(0.35149, 0.3512, 0.3518), "0.3515 (0.3512 to 0.3518) more");
  // An interval without width, as of a parameter at its bound, stays one.
  EXPECT_EQ(text_of(2, 2, 2), "2 (2 to 2)");
}

}  // namespace wording_test
