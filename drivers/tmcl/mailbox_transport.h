/// @file
/// TMCL over the EtherCAT mailbox as used by the youBot's controllers: the eight bytes of a telegram at the
/// start of the mailbox, in place of a mailbox header.
#pragma once
#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "drivers/ethercat/mailbox_line.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/tmcl/transport.h"

namespace drivers::tmcl {

/// During operation: telegrams travel in the cyclic frames. Cycle: post(), poll().
class MailboxTransport final : public Transport {
 public:
  /// `line` must outlive the transport.
  MailboxTransport(ethercat::MailboxLine& line, std::string name) : line_(line), name_(std::move(name)) {}

  bool post(const Request& request) noexcept override;
  std::optional<Reply> poll() noexcept override;
  const std::string& name() const noexcept override { return name_; }

 private:
  ethercat::MailboxLine& line_;
  std::string name_;
};

/// During set-up: post() waits for the reply, which poll() then returns.
class SetupMailboxTransport final : public Transport {
 public:
  /// `bus` must outlive the transport; `slave` counts from 0.
  SetupMailboxTransport(ethercat::PreOpBus& bus, std::size_t slave);

  bool post(const Request& request) noexcept override;
  std::optional<Reply> poll() noexcept override { return std::exchange(reply_, std::nullopt); }
  const std::string& name() const noexcept override { return name_; }
  std::string transport_fault() const override { return transport_fault_; }

 private:
  ethercat::PreOpBus& bus_;
  std::size_t slave_;
  std::string name_;
  std::string transport_fault_;
  std::optional<Reply> reply_;
};

}  // namespace drivers::tmcl
