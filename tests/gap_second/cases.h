/// @file
/// Cases of known truth, drawn by seed. A case is a drive, the effects that its model lacks, and the damage
/// to the data.
#pragma once
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/gap_second/bad_data.h"
#include "tests/gap_second/experiment.h"
#include "tests/gap_second/hidden_effect.h"

namespace gap_second {

/// a clean, b one effect missing, c two missing, d bad data, e a poor base model, f a cause outside any
/// library.
constexpr const char* kClasses = "abcdef";

struct Case {
  std::string id;    ///< such as b-17: class and number
  std::string kind;  ///< what the table counts it under
  Subject subject;
  BaseModel base;
  std::vector<std::string> hidden;  ///< effects of the library that the base model lacks
  std::string unknown_cause;        ///< empty: none
  std::string bad_data;             ///< empty: none
  std::set<std::string> also_fine;  ///< names that are neither right nor wrong here
  bool command_column = true;
  bool measured_column = true;
  std::uint64_t seed = 0;
};

/// @throws std::invalid_argument for an unknown class.
Case draw_case(char case_class, int number, std::uint64_t seed);

struct CaseFiles {
  std::string base;
  std::vector<std::string> data;
  std::vector<std::string> held_out;
};
/// Simulates, records and writes all files of the case into a directory that exists.
CaseFiles write_case(const Case& drawn, const std::string& directory);

}  // namespace gap_second
