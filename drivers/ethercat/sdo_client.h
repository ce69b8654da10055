/// @file
/// Objects of a CoE slave during set-up.
///
///   SdoClient sdo(bus, 3);
///   const std::vector<std::uint8_t> name = sdo.read(0x1008, 0);   // throws BusError
///   sdo.write(0x6060, 0, std::array<std::uint8_t, 1>{8});
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/ethercat/coe_sdo.h"
#include "drivers/ethercat/pre_op_bus.h"

namespace drivers::ethercat {

/// One per slave, kept during the slave's set-up: consecutive requests must carry different mailbox counters,
/// and a second client would restart the counter. Setup only: blocks and throws.
class SdoClient {
 public:
  static constexpr std::size_t kDefaultLimit = 65'536;
  static constexpr std::size_t kMaxEmergencies = 64;

  /// `bus` must outlive the client; `slave` counts from 0. @throws BusError if the slave does not support
  /// CoE.
  SdoClient(PreOpBus& bus, std::size_t slave);

  /// @throws BusError naming slave and object, with the text of the abort code; also if the object is longer
  /// than `limit` bytes.
  std::vector<std::uint8_t> read(std::uint16_t index, std::uint8_t subindex,
                                 std::size_t limit = kDefaultLimit) {
    return read(SdoObject{index, subindex}, limit);
  }
  void write(std::uint16_t index, std::uint8_t subindex, std::span<const std::uint8_t> data) {
    write(SdoObject{index, subindex}, data);
  }
  /// The same, for complete access.
  std::vector<std::uint8_t> read(const SdoObject& object, std::size_t limit = kDefaultLimit);
  void write(const SdoObject& object, std::span<const std::uint8_t> data);

  /// Emergencies of the slave since construction: the first kMaxEmergencies.
  const std::vector<CoeEmergency>& emergencies() const noexcept { return emergencies_; }

 private:
  void run(const char* step, const SdoObject& object);
  const Slave& slave() const noexcept { return bus_.slaves()[slave_]; }

  PreOpBus& bus_;
  std::size_t slave_;
  SdoTransfer transfer_;
  std::vector<CoeEmergency> emergencies_;
};

}  // namespace drivers::ethercat
