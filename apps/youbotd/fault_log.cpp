#include "apps/youbotd/fault_log.h"

#include <utility>

namespace youbotd {

FaultLog::News FaultLog::update(const std::vector<std::string>& faults) {
  News news;
  std::map<std::string, Device> before = std::exchange(devices_, {});
  for (const std::string& line : faults) {
    const std::string name = line.substr(0, line.find(": "));
    const auto [entry, is_first_line] = devices_.try_emplace(name);
    Device& device = entry->second;
    if (is_first_line) {
      device = std::move(before[name]);
      before.erase(name);
      ++device.beats;
    }
    if (device.beats >= kPatience && device.logged.size() < kMaxTexts && device.logged.insert(line).second)
      news.faults.push_back(line);
  }
  for (const auto& [name, device] : before)
    if (!device.logged.empty()) news.works_again.push_back(name);
  return news;
}

}  // namespace youbotd
