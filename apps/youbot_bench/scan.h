/// @file
/// `youbot-bench scan` and `parameters`: what is on an EtherCAT bus.
#pragma once
#include <string>

#include "drivers/ethercat/link.h"

namespace youbot_bench {

/// Prints every slave with identity, cabling and process data, and which youBot it is. Changes no state.
/// @throws drivers::ethercat::BusError.
void print_scan(drivers::ethercat::Link& link);

/// Prints `slave,name,firmware,number,parameter,value,unit` for every readable axis parameter of every motor
/// controller. Takes the bus to PRE-OP, so nothing may be moving. @throws BusError.
void print_parameters(drivers::ethercat::Link& link);

}  // namespace youbot_bench
