#include "drivers/can/bus_error.h"

#include <linux/can/error.h>

#include <algorithm>
#include <span>

namespace drivers::can {
namespace {

struct Word {
  std::uint32_t bit;
  const char* text;
};

constexpr Word kClasses[] = {
    {CAN_ERR_BUSOFF, "bus off (check wiring and termination, then set the interface down and up)"},
    {CAN_ERR_ACK, "no acknowledge (is the module powered, at the same bit rate, and the bus terminated?)"},
    {CAN_ERR_TX_TIMEOUT, "transmission timed out"},
    {CAN_ERR_LOSTARB, "lost arbitration"},
    {CAN_ERR_CRTL, "controller"},
    {CAN_ERR_PROT, "protocol violation"},
    {CAN_ERR_TRX, "transceiver"},
    {CAN_ERR_BUSERROR, "bus error"},
    {CAN_ERR_RESTARTED, "controller restarted"},
};

constexpr Word kController[] = {
    {CAN_ERR_CRTL_RX_OVERFLOW, "receive buffer overflow"},
    {CAN_ERR_CRTL_TX_OVERFLOW, "transmit buffer overflow"},
    {CAN_ERR_CRTL_RX_WARNING, "many receive errors"},
    {CAN_ERR_CRTL_TX_WARNING, "many transmit errors"},
    {CAN_ERR_CRTL_RX_PASSIVE, "error passive by receive errors"},
    {CAN_ERR_CRTL_TX_PASSIVE, "error passive by transmit errors"},
    {CAN_ERR_CRTL_ACTIVE, "error active again"},
};

constexpr Word kProtocol[] = {
    {CAN_ERR_PROT_BIT, "single bit"},
    {CAN_ERR_PROT_FORM, "frame format"},
    {CAN_ERR_PROT_STUFF, "bit stuffing: often a wrong bit rate"},
    {CAN_ERR_PROT_BIT0, "cannot send a dominant bit"},
    {CAN_ERR_PROT_BIT1, "cannot send a recessive bit"},
    {CAN_ERR_PROT_OVERLOAD, "overload"},
    {CAN_ERR_PROT_ACTIVE, "active error announcement"},
    {CAN_ERR_PROT_TX, "on transmission"},
};

// The two halves of the byte are for the two wires; these are values, not bits.
constexpr Word kTransceiver[] = {
    {CAN_ERR_TRX_CANH_NO_WIRE, "CAN-H not connected"},
    {CAN_ERR_TRX_CANH_SHORT_TO_BAT, "CAN-H shorted to the battery"},
    {CAN_ERR_TRX_CANH_SHORT_TO_VCC, "CAN-H shorted to the supply"},
    {CAN_ERR_TRX_CANH_SHORT_TO_GND, "CAN-H shorted to ground"},
    {CAN_ERR_TRX_CANL_NO_WIRE, "CAN-L not connected"},
    {CAN_ERR_TRX_CANL_SHORT_TO_BAT, "CAN-L shorted to the battery"},
    {CAN_ERR_TRX_CANL_SHORT_TO_VCC, "CAN-L shorted to the supply"},
    {CAN_ERR_TRX_CANL_SHORT_TO_GND, "CAN-L shorted to ground"},
    {CAN_ERR_TRX_CANL_SHORT_TO_CANH, "CAN-L shorted to CAN-H"},
};

void append(std::string& list, const std::string& item) { list += (list.empty() ? "" : ", ") + item; }

std::string bits_in_words(std::span<const Word> words, std::uint32_t bits) {
  std::string list;
  for (const Word& word : words) {
    if ((bits & word.bit) != 0) append(list, word.text);
  }
  return list.empty() ? "unspecified" : list;
}

std::string transceiver_in_words(std::uint8_t byte) {
  std::string list;
  for (const Word& word : kTransceiver) {
    const std::uint8_t half = word.bit > 0x0F ? 0xF0 : 0x0F;
    if ((byte & half) == word.bit) append(list, word.text);
  }
  return list.empty() ? "unspecified" : list;
}

}  // namespace

bool BusError::bus_off() const noexcept { return (classes & CAN_ERR_BUSOFF) != 0; }
bool BusError::no_acknowledge() const noexcept { return (classes & CAN_ERR_ACK) != 0; }

bool decode_error_frame(const can_frame& frame, BusError& error) noexcept {
  if ((frame.can_id & CAN_ERR_FLAG) == 0) return false;
  error.classes = frame.can_id & CAN_ERR_MASK;
  std::copy(std::begin(frame.data), std::end(frame.data), error.details.begin());
  return true;
}

std::string describe(const BusError& error) {
  if (!error.any()) return "no bus error";
  std::string list;
  for (const Word& word : kClasses) {
    if ((error.classes & word.bit) == 0) continue;
    std::string item = word.text;
    if (word.bit == CAN_ERR_LOSTARB) item += " at bit " + std::to_string(error.details[0]);
    if (word.bit == CAN_ERR_CRTL) item += ": " + bits_in_words(kController, error.details[1]);
    if (word.bit == CAN_ERR_PROT) item += ": " + bits_in_words(kProtocol, error.details[2]);
    if (word.bit == CAN_ERR_TRX) item += ": " + transceiver_in_words(error.details[4]);
    append(list, item);
  }
  if ((error.classes & CAN_ERR_CNT) != 0) {
    append(list, "transmit error counter " + std::to_string(error.details[6]));
    append(list, "receive error counter " + std::to_string(error.details[7]));
  }
  return list.empty() ? "an unknown bus error" : list;
}

}  // namespace drivers::can
