#include <string>

#include "apps/youbotd/check_parts.h"
#include "drivers/setup_error.h"
#include "drivers/station/key.h"
#include "drivers/station/udp_port.h"

namespace youbotd {

Findings check_link(runtime::Role role, const runtime::LinkOptions& link) {
  if (role == runtime::Role::kBoth) return {};
  Findings findings;
  const auto look = [&findings](const std::string& good, const auto& attempt) {
    try {
      attempt();
      findings.push_back({Finding::Mark::kOk, good});
    } catch (const drivers::SetupError& error) {
      const drivers::SetupError::Report& report = error.report();
      findings.push_back({Finding::Mark::kFail, report.device + ": " + report.found, report.hint});
    }
  };
  using drivers::station::UdpPort;
  look("key of the link: " + link.key_file.string(),
       [&] { (void)drivers::station::read_key_file(link.key_file); });
  if (role == runtime::Role::kRobot)
    look("link: " + link.listen + " is free", [&] { (void)UdpPort::listening(link.listen); });
  else
    look("link: " + link.peer + " has an address", [&] { (void)UdpPort::towards(link.peer); });
  return findings;
}

}  // namespace youbotd
