/// @file
/// The EtherCAT back-end: the youBot on a network interface, and the master below it for other slaves.
///
///     auto robot = youbot::make_ethercat_robot("eth0", {.kind = youbot::YoubotKind::kBase}, clock, 1ms);
///
///     youbot::ethercat::RawSocketLink link("eth0", youbot::ethercat::RawSocketLink::Wait::kBlock);
///     youbot::ethercat::PreOpBus bus(link, nullptr, {});           // scans; throws BusError
///     bus.enter_pre_op();
///     youbot::ethercat::SdoClient(bus, 2).read(0x1018, 1);         // slave 3, its vendor
///
/// Set-up blocks and throws BusError naming slave, step and cause. Needs CAP_NET_RAW.
#pragma once
#include "drivers/ethercat/bus_error.h"
#include "drivers/ethercat/pre_op_bus.h"
#include "drivers/ethercat/raw_socket_link.h"
#include "drivers/ethercat/sdo_client.h"
#include "hal/ethercat_robot.h"

namespace youbot {

using hal::EthercatOptions;
using hal::make_ethercat_robot;
namespace ethercat = drivers::ethercat;

}  // namespace youbot
