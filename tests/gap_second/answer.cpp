#include "tests/gap_second/answer.h"

#include <sys/wait.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace gap_second {
namespace {

using Json = nlohmann::json;

std::string content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string quoted(const std::string& path) { return " '" + path + "'"; }

std::string line_with(const std::string& text, const std::string& words) {
  const std::size_t at = text.find(words);
  if (at == std::string::npos) return {};
  const std::size_t begin = text.rfind('\n', at) + 1;
  return text.substr(begin, text.find('\n', at) - begin);
}

std::optional<std::pair<double, double>> interval_of(const Json& parameter) {
  const auto ci = parameter.find("ci95");
  if (ci == parameter.end() || !ci->is_array() || ci->size() != 2) return {};
  if (!(*ci)[0].is_number() || !(*ci)[1].is_number()) return {};
  return std::pair{(*ci)[0].get<double>(), (*ci)[1].get<double>()};
}

double number(const Json& object, const char* key) {
  const auto value = object.find(key);
  return value != object.end() && value->is_number() ? value->get<double>() : 0.0;
}

void read_findings(const std::string& text, Answer& answer) {
  const Json json = Json::parse(text);
  answer.verdict = json.at("verdict").get<std::string>();
  answer.floor_Nm = number(json, "noise_floor_Nm");
  answer.gap_before_Nm = number(json.at("gap"), "before");
  answer.gap_refitted_Nm = number(json.at("gap"), "refitted");
  answer.gap_after_Nm = number(json.at("gap"), "after");
  if (const auto simulation = json.find("simulation"); simulation != json.end() && simulation->is_object())
    answer.simulation = {number(*simulation, "before"), number(*simulation, "after")};
  if (const auto diagnosis = json.find("diagnosis"); diagnosis != json.end()) {
    answer.diagnosis = diagnosis->dump();
    std::transform(answer.diagnosis.begin(), answer.diagnosis.end(), answer.diagnosis.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  }
  for (const Json& effect : json.at("effects")) {
    NamedEffect named{effect.at("type").get<std::string>(),
                      effect.value("equivalent", std::vector<std::string>{})};
    named.determined = effect.at("parameters").empty();
    for (const auto& [name, parameter] : effect.at("parameters").items()) {
      const auto interval = interval_of(parameter);
      if (!interval) continue;
      answer.intervals[named.type + "." + name] = *interval;
      named.determined = named.determined || interval->first > 0 || interval->second < 0;
    }
    answer.effects.push_back(named);
  }
  for (const Json& refit : json.value("refitted", Json::array())) {
    const auto type = refit.at("type").get<std::string>();
    if (const auto interval = interval_of(refit))
      answer.intervals[(type.empty() ? "" : type + ".") + refit.at("parameter").get<std::string>()] =
          *interval;
  }
}

/// Lines of the documented format; a whole TOML parser would be more than they need.
void read_model(const std::string& path, Answer& answer) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const std::size_t equals = line.find(" = ");
    if (line.starts_with('#') || equals == std::string::npos) continue;
    const std::string key = line.substr(0, equals);
    const std::string value = line.substr(equals + 3);
    if (key == "inertia_kg_m2" || key == "difference_kg_m2") answer.inertia_kg_m2 += std::stod(value);
    if (key == "type") answer.model_effects.push_back(value.substr(1, value.find('"', 1) - 1));
  }
}

}  // namespace

Answer ask(const std::string& program, const CaseFiles& files, const std::string& directory, int longest_s) {
  const std::string log = directory + "/log.txt";
  std::string command =
      "timeout " + std::to_string(longest_s) + quoted(program) + " --model" + quoted(files.base);
  command += " --data";
  for (const std::string& file : files.data) command += quoted(file);
  command += " --held-out";
  for (const std::string& file : files.held_out) command += quoted(file);
  command += " --out" + quoted(directory + "/gap");
  std::ofstream(directory + "/command.txt") << command << "\n";
  Answer answer;
  const auto begin = std::chrono::steady_clock::now();
  const int status = std::system((command + " >" + quoted(log) + " 2>&1 </dev/null").c_str());
  answer.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  answer.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  answer.error = line_with(content(log), "error:");
  if (answer.exit_code != 0) return answer;
  const std::string findings = content(directory + "/gap/gap.json");
  if (findings.empty()) throw std::runtime_error("exit code 0 and no gap.json in " + directory);
  read_findings(findings, answer);
  read_model(directory + "/gap/model.toml", answer);
  return answer;
}

}  // namespace gap_second
