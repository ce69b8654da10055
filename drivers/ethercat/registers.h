/// @file
/// Registers of an EtherCAT slave controller (ETG.1000.4, Beckhoff ESC data sheet section II).
#pragma once
#include <cstdint>

namespace drivers::ethercat::reg {

inline constexpr std::uint16_t kType = 0x0000;
inline constexpr std::uint16_t kFmmuCount = 0x0004;
inline constexpr std::uint16_t kSyncManagerCount = 0x0005;
inline constexpr std::uint16_t kRamKilobytes = 0x0006;
inline constexpr std::uint16_t kPortDescriptor = 0x0007;
inline constexpr std::uint16_t kFeatures = 0x0008;
inline constexpr std::uint16_t kStationAddress = 0x0010;
inline constexpr std::uint16_t kStationAlias = 0x0012;

inline constexpr std::uint16_t kDlControl = 0x0100;
inline constexpr std::uint16_t kDlStatus = 0x0110;

inline constexpr std::uint16_t kAlControl = 0x0120;
inline constexpr std::uint16_t kAlStatus = 0x0130;
inline constexpr std::uint16_t kAlStatusCode = 0x0134;
inline constexpr std::uint16_t kPdiControl = 0x0140;

inline constexpr std::uint16_t kEventMask = 0x0200;
inline constexpr std::uint16_t kEventRequest = 0x0210;
inline constexpr std::uint16_t kDlStatusEvent = 0x0004;  ///< in the event request
inline constexpr std::uint16_t kAlStatusEvent = 0x0008;

inline constexpr std::uint16_t kRxErrorCounters = 0x0300;         ///< per port: invalid frame, RX error
inline constexpr std::uint16_t kForwardedErrorCounters = 0x0308;  ///< per port
inline constexpr std::uint16_t kProcessingErrorCounter = 0x030C;
inline constexpr std::uint16_t kPdiErrorCounter = 0x030D;
inline constexpr std::uint16_t kLostLinkCounters = 0x0310;  ///< per port

inline constexpr std::uint16_t kWatchdogDivider = 0x0400;  ///< in 40 ns, plus 2
inline constexpr std::uint16_t kWatchdogPdi = 0x0410;
inline constexpr std::uint16_t kWatchdogProcessData = 0x0420;
inline constexpr std::uint16_t kWatchdogStatus = 0x0440;
inline constexpr std::uint16_t kWatchdogCounters = 0x0442;

inline constexpr std::uint16_t kSiiConfiguration = 0x0500;
inline constexpr std::uint16_t kSiiControl = 0x0502;
inline constexpr std::uint16_t kSiiAddress = 0x0504;
inline constexpr std::uint16_t kSiiData = 0x0508;

inline constexpr std::uint16_t kFmmu = 0x0600;  ///< 16 bytes each
inline constexpr std::uint16_t kFmmuBytes = 16;
inline constexpr std::uint16_t kSyncManager = 0x0800;  ///< 8 bytes each
inline constexpr std::uint16_t kSyncManagerBytes = 8;
inline constexpr std::uint16_t kSyncManagerStatus = 5;    ///< within a sync manager
inline constexpr std::uint16_t kSyncManagerActivate = 6;  ///< within a sync manager
inline constexpr std::uint16_t kSyncManagerPdi = 7;       ///< within a sync manager

inline constexpr std::uint16_t kDcReceiveTimes = 0x0900;  ///< four ports, 4 bytes each; a write latches them
inline constexpr std::uint16_t kDcSystemTime = 0x0910;
inline constexpr std::uint16_t kDcReceiveTimeUnit = 0x0918;
inline constexpr std::uint16_t kDcSystemTimeOffset = 0x0920;
inline constexpr std::uint16_t kDcSystemTimeDelay = 0x0928;
inline constexpr std::uint16_t kDcSystemTimeDifference = 0x092C;
inline constexpr std::uint16_t kDcSpeedCounterStart = 0x0930;
inline constexpr std::uint16_t kDcSpeedCounterDifference = 0x0932;
inline constexpr std::uint16_t kDcSystemTimeFilter = 0x0934;  ///< depth; the speed counter's filter depth
                                                              ///< follows it
inline constexpr std::uint16_t kDcActivation = 0x0980;
inline constexpr std::uint16_t kDcStartTime = 0x0990;
inline constexpr std::uint16_t kDcSync0Cycle = 0x09A0;

inline constexpr std::uint16_t kProcessMemory = 0x1000;

// Bits.
inline constexpr std::uint8_t kAlError = 0x10;             ///< AL control: acknowledge; AL status: error
inline constexpr std::uint16_t kSiiReadCommand = 0x0100;   ///< in kSiiControl
inline constexpr std::uint16_t kSiiWriteCommand = 0x0201;  ///< with write enable
inline constexpr std::uint16_t kSiiBusy = 0x8000;
inline constexpr std::uint16_t kSiiErrors = 0x7800;
inline constexpr std::uint16_t kSiiReads8Bytes = 0x0040;
inline constexpr std::uint8_t kMailboxFull = 0x08;         ///< in a sync manager's status
inline constexpr std::uint8_t kSyncManagerEnabled = 0x01;  ///< in a sync manager's activate register
inline constexpr std::uint8_t kRepeatRequest = 0x02;       ///< in a sync manager's activate register
inline constexpr std::uint8_t kRepeatAcknowledge = 0x02;   ///< in a sync manager's PDI register

}  // namespace drivers::ethercat::reg
