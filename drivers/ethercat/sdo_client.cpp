#include "drivers/ethercat/sdo_client.h"

#include <string>

#include "drivers/ethercat/bus_error.h"

namespace drivers::ethercat {

SdoClient::SdoClient(PreOpBus& bus, std::size_t slave) : bus_(bus), slave_(slave) {
  const Slave& info = bus_.slaves().at(slave_);
  if (!info.mailbox_fits || !info.sii.speaks_coe())
    throw BusError(
        info.label(), "use CoE",
        info.mailbox_fits ? "its SII names no CoE among its mailbox protocols" : "it has no mailbox");
}

std::vector<std::uint8_t> SdoClient::read(const SdoObject& object, std::size_t limit) {
  std::vector<std::uint8_t> data(limit);
  transfer_.begin_upload(object, data, slave().sii.mailbox_out.length);
  run("read object ", object);
  data.resize(transfer_.transferred());
  return data;
}

void SdoClient::write(const SdoObject& object, std::span<const std::uint8_t> data) {
  transfer_.begin_download(object, data, slave().sii.mailbox_out.length);
  run("write object ", object);
}

void SdoClient::run(const char* step, const SdoObject& object) {
  unsigned seen = 0;
  while (transfer_.under_way()) {
    // An empty request only waits for the next mail.
    const std::span<const std::uint8_t> request =
        transfer_.must_send() ? transfer_.request() : std::span<const std::uint8_t>();
    try {
      transfer_.take(bus_.mailbox_exchange(slave_, request));
    } catch (const BusError& error) {
      const std::string what = error.what();  // begins with the device
      throw BusError(error.device(), step + to_string(object), what.substr(error.device().size() + 2));
    }
    if (transfer_.emergencies() != seen && emergencies_.size() < kMaxEmergencies)
      emergencies_.push_back(transfer_.last_emergency());
    seen = transfer_.emergencies();
  }
  if (transfer_.status() != SdoTransfer::Status::kDone)
    throw BusError(slave().label(), step + to_string(object), transfer_.failure());
}

}  // namespace drivers::ethercat
