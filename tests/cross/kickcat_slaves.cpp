// kickcat_slaves INTERFACE EEPROM...: serves KickCAT's slaves (emulated controller, state machine, mailbox
// and CoE), one per EEPROM image, on a raw socket. Each answers its outputs: input byte 0 counts, byte i is
// the complement of output byte (i - 1) modulo the number of outputs.
#include <kickcat/CoE/OD.h>
#include <kickcat/CoE/mailbox/response.h>
#include <kickcat/ESC/EmulatedESC.h>
#include <kickcat/EmulatedNetwork.h>
#include <kickcat/Frame.h>
#include <kickcat/OS/Linux/Socket.h>
#include <kickcat/PDO.h>
#include <kickcat/SIIParser.h>
#include <kickcat/slave/Slave.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <numeric>
#include <vector>

namespace {

using namespace std::chrono_literals;
namespace coe = kickcat::CoE;

volatile std::sig_atomic_t stopped = 0;

constexpr std::size_t kLongObject = 1000;  // bytes; several segments whatever the mailbox

/// Objects that the test reads and writes: known text, a number, and more bytes than fit one mailbox.
coe::Dictionary dictionary() {
  coe::Dictionary objects;
  coe::Object name{0x1008, coe::ObjectCode::VAR, "Device name", {}};
  const char* text = "a KickCAT slave";
  coe::addEntry<const char*>(name, 0, 15 * 8, 0, coe::Access::READ, coe::DataType::VISIBLE_STRING, "", text);
  objects.push_back(std::move(name));

  coe::Object number{0x2000, coe::ObjectCode::VAR, "Number", {}};
  coe::addEntry<std::uint32_t>(number, 0, 32, 0, coe::Access::READ | coe::Access::WRITE,
                               coe::DataType::UNSIGNED32, "", 0x12345678);
  objects.push_back(std::move(number));

  std::array<std::uint8_t, kLongObject> bytes{};
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  coe::Object array{0x2001, coe::ObjectCode::VAR, "Bytes", {}};
  coe::addEntry(array, 0, kLongObject * 8, 0, coe::Access::READ | coe::Access::WRITE,
                coe::DataType::OCTET_STRING, "", bytes);
  objects.push_back(std::move(array));
  return objects;
}

class Device {
 public:
  explicit Device(const char* eeprom) : pdo_(&controller_), slave_(&controller_, &pdo_) {
    const std::vector<std::uint8_t> image = kickcat::loadBinaryFile(eeprom);
    controller_.loadEeprom(image);
    kickcat::eeprom::SII sii;
    sii.parse(image);
    if ((sii.info.mailbox_protocol & kickcat::eeprom::MailboxProtocol::CoE) != 0) {
      mailbox_ = std::make_unique<kickcat::mailbox::response::Mailbox>(&controller_, std::uint16_t{1024});
      mailbox_->enableCoE(objects_);
      slave_.setMailbox(mailbox_.get());
    }
    pdo_.setInput(inputs_.data(), static_cast<std::uint32_t>(inputs_.size()));
    pdo_.setOutput(outputs_.data(), static_cast<std::uint32_t>(outputs_.size()));
    slave_.start();
  }

  kickcat::EmulatedESC& controller() { return controller_; }

  void advance() {
    slave_.routine();
    if (slave_.state() == kickcat::State::SAFE_OP) slave_.validateOutputData();
    ++inputs_[0];
    const std::size_t outputs = output_bytes();
    for (std::size_t i = 1; i < inputs_.size() && outputs > 0; ++i)
      inputs_[i] = static_cast<std::uint8_t>(~outputs_[(i - 1) % outputs]);
  }

 private:
  /// As the master has set the sync managers; an EEPROM may leave it to its PDOs.
  std::size_t output_bytes() {
    constexpr std::uint8_t kBufferedWrite = 0x04;
    for (std::uint8_t i = 0; i < 4; ++i) {
      kickcat::SyncManager::Register manager{};
      controller_.read(kickcat::addressSM(i), &manager, sizeof manager);
      if ((manager.control & 0x0F) == kBufferedWrite) return manager.length;
    }
    return 0;
  }

  kickcat::EmulatedESC controller_;
  kickcat::PDO pdo_;
  kickcat::slave::Slave slave_;
  coe::Dictionary objects_ = dictionary();
  std::unique_ptr<kickcat::mailbox::response::Mailbox> mailbox_;
  std::array<std::uint8_t, 256> inputs_{};
  std::array<std::uint8_t, 256> outputs_{};
};

int serve(const char* interface, const std::vector<const char*>& eeproms) {
  std::vector<std::unique_ptr<Device>> devices;
  std::vector<kickcat::EmulatedESC*> controllers;
  for (const char* eeprom : eeproms) {
    devices.push_back(std::make_unique<Device>(eeprom));
    controllers.push_back(&devices.back()->controller());
  }
  kickcat::EmulatedNetwork network(controllers);
  kickcat::Socket socket;
  socket.open(interface);
  socket.setTimeout(100ms);
  std::printf("serving %zu slaves\n", devices.size());
  std::fflush(stdout);
  while (stopped == 0) {
    kickcat::Frame frame;
    const std::int32_t size = socket.read(frame.data(), kickcat::ETH_MAX_SIZE);
    if (size <= 0 || !network.route(frame)) continue;
    if (socket.write(frame.data(), size) < 0) return 1;
    for (const auto& device : devices) device->advance();
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: kickcat_slaves INTERFACE EEPROM...\n");
    return 2;
  }
  std::signal(SIGTERM, [](int) { stopped = 1; });
  try {
    return serve(argv[1], {argv + 2, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "kickcat_slaves: %s\n", error.what());
    return 3;
  }
}
