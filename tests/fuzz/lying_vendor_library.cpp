// The vendor's symbols with results from a fuzzer's input (force_dimension_sdk.h defines valid ones).
#include "tests/fuzz/lying_vendor_library.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace {

constexpr std::uint8_t kHonest = 224;
fuzz::VendorLies lies;
std::uint8_t watchdog = 0;
bool force_on = false;

std::uint8_t next() {
  ++lies.calls;
  if (lies.left.empty()) return 0;
  const std::uint8_t byte = lies.left.front();
  lies.left = lies.left.subspan(1);
  return byte;
}
bool is_lie(std::uint8_t byte) { return byte >= kHonest; }

/// A result code.
int result(int honest = 0) {
  constexpr std::array<int, 8> kOthers{
      -1, 1, 2, 3, 127, 255, std::numeric_limits<int>::min(), std::numeric_limits<int>::max()};
  const std::uint8_t byte = next();
  return is_lie(byte) ? kOthers[byte % kOthers.size()] : honest;
}

double number(double honest) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr std::array<double, 8> kOthers{
      std::numeric_limits<double>::quiet_NaN(), kInfinity, -kInfinity, 1e308, -1e308, 1e-310, 0.0, -7.0};
  const std::uint8_t byte = next();
  return is_lie(byte) ? kOthers[byte % kOthers.size()] : honest;
}

int pose(double* x, double* y, double* z) {
  for (double* const axis : {x, y, z}) *axis = number(0.01);
  return result();
}
int orientation(double rotation[3][3]) {
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) rotation[row][column] = number(row == column ? 1.0 : 0.0);
  return result();
}

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): the vendor's names
extern "C" {
fuzz::VendorLies* vendor_lies() {
  watchdog = 0;
  force_on = false;
  lies = {};
  return &lies;
}

void dhdGetSDKVersion(int* major, int* minor, int* release, int* revision) {
  *major = 3;
  *minor = 17;
  *release = 5;
  *revision = 0;
}
int dhdErrorGetLast() { return result(); }
int dhdGetDeviceCount() { return result(1); }
int dhdGetAvailableCount() { return result(1); }
int dhdGetSystemType(char) { return result(34); }
int dhdGetSerialNumber(std::uint16_t* serial, char) { return *serial = next(), result(); }
int dhdGetVersion(double* firmware, char) { return *firmware = number(3.2), result(); }
int dhdOpenID(char) { return result(); }
int dhdOpenType(int) { return result(); }
int dhdOpenSerial(int) { return result(); }
int dhdClose(char) { return result(); }
int dhdGetStatus(int* status, char) {
  std::fill_n(status, 17, 0);
  status[0] = status[1] = 1;
  status[5] = force_on ? 1 : 0;
  if (const std::uint8_t slot = next(); is_lie(slot)) status[slot % 17] = result(1);
  return result();
}
std::uint32_t dhdGetButtonMask(char) { return static_cast<std::uint32_t>(result()); }
int dhdGetButton(int, char) { return result(); }
int dhdGetPosition(double* x, double* y, double* z, char) { return pose(x, y, z); }
int dhdGetOrientationFrame(double rotation[3][3], char) { return orientation(rotation); }
int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z, double rotation[3][3], char) {
  const int first = pose(x, y, z);
  return first < 0 ? first : orientation(rotation);
}
int dhdEnableForce(std::uint8_t on, char) { return force_on = on != 0, result(); }
int dhdStop(char) {
  const int answer = result();
  lies.refuses_stop = answer < 0;
  if (answer >= 0) force_on = false, lies.command_N = {};
  return answer;
}
int dhdSetForce(double x, double y, double z, char) {
  lies.command_N = {x, y, z};
  const double magnitude_N = std::hypot(x, y, z);
  if (!(magnitude_N <= lies.largest_command_N)) lies.largest_command_N = magnitude_N;
  return result();
}
int dhdSetMaxForce(double, char) { return result(); }
int dhdSetGravityCompensation(int, char) { return result(); }
int dhdSetEffectorMass(double, char) { return result(); }
int drdOpenID(char id) { return result(id); }
int drdClose(char) { return result(); }
bool drdIsInitialized(char) { return !is_lie(next()); }
int drdAutoInit(char) { return result(); }
int drdStop(bool, char) { return result(); }
int dhdEnableExpertMode() { return result(); }
int dhdDisableExpertMode() { return result(); }
int dhdSetWatchdog(std::uint8_t ticks, char) { return watchdog = ticks, result(); }
int dhdGetWatchdog(std::uint8_t* ticks, char) {
  const std::uint8_t byte = next();
  *ticks = is_lie(byte) ? byte : watchdog;
  return result();
}
int dhdGetVelocityThreshold(std::uint32_t* threshold, char) {
  return *threshold = static_cast<std::uint32_t>(result(1500)), result();
}
int dhdSetTimeGuard(int, char) { return result(); }
}
// NOLINTEND(readability-identifier-naming)
