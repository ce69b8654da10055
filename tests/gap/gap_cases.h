/// @file
/// The fixed list of cases for the search for missing effects: nothing missing, one to three effects missing,
/// or a cause outside the library.
#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "identification/gap/gap.h"
#include "model/effects/drive_model.h"
#include "tests/gap/hidden_experiment.h"

namespace gap_test {

enum class CaseKind : std::uint8_t { kNone, kSingle, kPair, kTriple, kOutside };
std::string_view name_of(CaseKind kind);

struct CaseSpec {
  CaseKind kind = CaseKind::kNone;
  std::vector<Hidden> hidden{};  ///< the effects that the model lacks
  double size = 0;               ///< rms effect on the torque, in noise floors, as far as possible
  std::uint64_t seed = 1;        ///< of plant, shapes, sensors and recordings
  std::string name() const;
};

struct TrueParameter {
  std::string effect;
  std::string parameter;
  double value;
  double resolution;  ///< how finely the data defines it
};

struct Case {
  CaseSpec spec;
  Drive drive;
  model::effects::DriveModel base;
  std::vector<Run> runs;  ///< that made `data`
  std::vector<Run> held_out_runs;
  std::vector<identification::gap::Source> data;
  std::vector<identification::gap::Source> held_out;
  std::vector<double> sizes;              ///< actual ones, in the order of spec.hidden
  std::vector<TrueParameter> parameters;  ///< those with the same meaning in plant and library
  double least_size() const;
};

/// Recordings of a drive that follows the runs, named after their experiments.
std::vector<identification::gap::Source> recordings_of(const Drive& drive, const std::vector<Run>& runs,
                                                       std::string_view prefix = "");

std::vector<CaseSpec> gap_cases();
/// `length` scales the recordings: five of 20 to 28 s, and two of 16 s held out.
Case make_case(const CaseSpec& spec, double length = 1);

}  // namespace gap_test
