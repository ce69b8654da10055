/// @file
/// Who has a network interface: one master, and one that answers for the slaves.
#pragma once
#include <string>

#include "drivers/ethercat/bus_error.h"

namespace drivers::ethercat {

/// Somebody else has it.
class InterfaceInUse : public BusError {
 public:
  using BusError::BusError;
};

/// Two masters on one bus take each other's answers and reset each other's slaves: a robot under way falls.
/// So each holds its interface, by a name in the abstract space of Unix sockets: that space belongs to the
/// network namespace, as interfaces do, and the kernel frees a name however its holder ends. Programs that do
/// not ask for it, such as other masters, are not kept away.
class InterfaceLock {
 public:
  enum class End { kMaster, kSlaves };

  /// `index` is the interface's. @throws InterfaceInUse naming the holder, BusError when the system refuses.
  InterfaceLock(const std::string& interface, int index, End end);
  InterfaceLock(const InterfaceLock&) = delete;
  InterfaceLock& operator=(const InterfaceLock&) = delete;
  ~InterfaceLock();

 private:
  int socket_ = -1;
};

}  // namespace drivers::ethercat
