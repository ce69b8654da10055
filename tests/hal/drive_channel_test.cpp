// One drive of the EtherCAT robot without its bus: its behaviour while no answer arrives.
#include "hal/ethercat/drive_channel.h"

#include <gtest/gtest.h>

#include <array>

namespace hal {
namespace drive_channel_test {

using namespace std::chrono_literals;
namespace tmcl = drivers::tmcl;
using tmcl::StatusFlag;

class Channel : public testing::Test {
 protected:
  /// The drive says so.
  void hear(std::initializer_list<StatusFlag> flags) {
    std::uint32_t bits = 0;
    for (const StatusFlag flag : flags) bits |= 1U << static_cast<unsigned>(flag);
    std::array<std::uint8_t, tmcl::input_bytes(tmcl::Firmware::k148)> pdo{};
    tmcl::DriveInput input;
    input.flags = tmcl::StatusFlags(bits);
    ASSERT_TRUE(pack(tmcl::Firmware::k148, input, pdo));
    ASSERT_TRUE(drive.sense(pdo));
  }
  /// Commands it to continue.
  tmcl::DriveOutput tell() {
    std::array<std::uint8_t, tmcl::kOutputBytes> pdo{};
    drive.prepare();
    drive.drive({}, false, pdo);
    tmcl::DriveOutput output;
    EXPECT_TRUE(unpack(pdo, output));
    return output;
  }

  DriveChannel drive{{.board = {}, .firmware = tmcl::Firmware::k148, .parameters = {}, .period = 1ms}};
};

TEST_F(Channel, WithoutNewsFromTheDriveItsPreparationStandsStill) {
  hear({});
  (void)tell();
  // Longer than any time-out of its steps.
  for (int i = 0; i < 20'000; ++i) (void)tell();
  EXPECT_FALSE(drive.failed()) << describe(drive.failure());
  for (int i = 0; i < 20'000 && !drive.failed(); ++i) {
    hear({});
    (void)tell();
  }
  EXPECT_TRUE(drive.failed()) << "its request was not answered";
}

TEST_F(Channel, ADriveThatLostItsMemoryIsNotJudgedByWhatItSaidBefore) {
  hear({});
  ASSERT_TRUE(drive.restore());
  (void)tell();
  hear({StatusFlag::kTimeout});  // its first words: to be cleared, not to fail on
  EXPECT_EQ(tell(), tmcl::kStopMotor);
  EXPECT_FALSE(drive.failed()) << describe(drive.failure());
}

}  // namespace drive_channel_test
}  // namespace hal
