// Fits and the search for missing effects.
#include <pybind11/functional.h>
#include <youbot/identification.h>

#include <functional>
#include <map>
#include <stdexcept>
#include <utility>

#include "python/bindings.h"

namespace youbot_python {
namespace {

using identification::fit::Estimate;
using youbot::DriveModel;
using youbot::Recording;
using youbot::StaticFit;
namespace gap = youbot::gap;

std::map<std::string, Estimate> by_name(const std::vector<Estimate>& estimates) {
  std::map<std::string, Estimate> result;
  for (const Estimate& estimate : estimates) result.emplace(estimate.name, estimate);
  return result;
}

StaticFit fit_friction(const Numbers& velocity, const Numbers& torque, const std::string& law,
                       const Numbers& ci95) {
  const py::ssize_t count = velocity.size();
  if (torque.size() != count || (ci95.size() != 0 && ci95.size() != count))
    throw std::invalid_argument("velocity_rad_per_s, torque_Nm and torque_ci95_Nm must be of one length");
  youbot::StaticMap map;
  for (py::ssize_t i = 0; i < count; ++i)
    map.points.push_back({.velocity_rad_per_s = velocity.data()[i],
                          .torque_Nm = torque.data()[i],
                          .torque_ci95_Nm = ci95.size() != 0 ? ci95.data()[i] : 0});
  const py::gil_scoped_release release;
  return youbot::fit_static(map, youbot::form_named(law));
}

gap::Result search(const DriveModel& model, const std::vector<Recording>& recordings,
                   const std::vector<Recording>& held_out, std::uint64_t seed,
                   const std::function<void(const std::string&, double)>& progress) {
  const auto sources = [](const std::vector<Recording>& given, const std::string& name) {
    std::vector<gap::Source> result;
    for (std::size_t i = 0; i < given.size(); ++i)
      result.push_back({.name = name + " " + std::to_string(i + 1), .recording = given[i]});
    return result;
  };
  gap::Options options;
  options.seed = seed;
  // Called between steps of the search; also handles Ctrl-C.
  options.progress = [&progress](std::string_view what, double done) {
    const py::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (progress) progress(std::string(what), done);
  };
  const py::gil_scoped_release release;
  return gap::analyse(model, sources(recordings, "recording"), sources(held_out, "held-out recording"),
                      options);
}

void add_fit(py::module_& module) {
  py::class_<Estimate>(module, "Estimate",
                       "A parameter with its 95 % interval, or the reason why there is none.")
      .def_readonly("name", &Estimate::name)
      .def_readonly("effect", &Estimate::effect,
                    "Effect of the parameter; empty: a parameter of the drive itself.")
      .def_readonly("value", &Estimate::value)
      .def_readonly("lower", &Estimate::lower)
      .def_readonly("upper", &Estimate::upper)
      .def_readonly("not_identifiable", &Estimate::not_identifiable,
                    "Reason why it is not; empty: the value is valid.")
      .def("__repr__", [](const Estimate& e) {
        return py::str("<Estimate {} = {:.4g} ({:.4g} to {:.4g}){}>")
            .format(e.title(), e.value, e.lower, e.upper,
                    e.ok() ? "" : ", not identifiable: " + e.not_identifiable);
      });
  py::class_<StaticFit>(module, "FrictionFit", "Effects whose torques add up to measured friction.")
      .def_readonly("parameters", &StaticFit::parameters)
      .def_property_readonly("effects", [](const StaticFit& fit) { return wrapped(fit.effects); })
      .def_readonly("relative_error_percent", &StaticFit::relative_error_percent)
      .def_readonly("verdicts", &StaticFit::verdicts, "Conclusions that the points do not allow.")
      .def_readonly("outliers", &StaticFit::outliers, "Indices of the points that were left out.")
      .def(
          "torque_Nm",
          [](const StaticFit& fit, const Numbers& velocity) {
            return py::vectorize([&fit](double v) { return fit.torque_Nm(v); })(velocity);
          },
          py::arg("velocity_rad_per_s"));
  module.def("fit_friction", &fit_friction, py::arg("velocity_rad_per_s"), py::arg("torque_Nm"),
             py::arg("law") = "kfm", py::kw_only(), py::arg("torque_ci95_Nm") = Numbers(0),
             R"(Fits friction measured at constant velocities.

law: name of a law, with optional terms: "kfm+offset+asymmetry+quadratic".)");
}

void add_search(py::module_& module) {
  py::class_<gap::FoundEffect>(module, "FoundEffect", "An effect that the model lacked.")
      .def_property_readonly(
          "name", [](const gap::FoundEffect& found) { return std::string(youbot::name_of(found.effect)); })
      .def_property_readonly("effect", [](const gap::FoundEffect& found) { return Effect{found.effect}; })
      .def_property_readonly(
          "parameters", [](const gap::FoundEffect& found) { return by_name(found.parameters); },
          "Estimates by name.")
      .def_readonly("held_out_gain", &gap::FoundEffect::held_out_gain,
                    "Share of the squared held-out residual that it removes.")
      .def_readonly("p_value", &gap::FoundEffect::p_value)
      .def_readonly("gap_before_Nm", &gap::FoundEffect::gap_before)
      .def_readonly("gap_after_Nm", &gap::FoundEffect::gap_after)
      .def_readonly("equivalent", &gap::FoundEffect::equivalent,
                    "Effects that these data do not distinguish from it.");
  py::class_<gap::Result>(module, "Gap",
                          "The gap between a model and recordings, and the effects that explain it.")
      .def_property_readonly(
          "verdict", [](const gap::Result& result) { return std::string(gap::verdict_name(result.verdict)); })
      .def_readonly("model", &gap::Result::model, "The model with refitted parameters and the added effects.")
      .def_readonly("effects", &gap::Result::effects)
      .def_readonly("gap_before_Nm", &gap::Result::gap_before_Nm,
                    "Held-out RMS torque residual of the given model.")
      .def_readonly("gap_after_Nm", &gap::Result::gap_after_Nm)
      .def_readonly("noise_floor_Nm", &gap::Result::noise_floor_Nm)
      .def_readonly("notes", &gap::Result::notes)
      .def_property_readonly(
          "rejected",
          [](const gap::Result& result) {
            std::map<std::string, std::string> reasons;
            for (const gap::RejectedEffect& rejected : result.rejected)
              reasons.emplace(rejected.type, rejected.reason);
            return reasons;
          },
          "Reason why each other effect was not added.")
      .def_property_readonly("diagnosis", [](const gap::Result& result) {
        std::vector<std::string> lines;
        for (const gap::Diagnosis& d : result.diagnosis)
          lines.push_back(d.recording + ", " + d.column + ": " + d.found +
                          (d.done.empty() ? "" : "; " + d.done));
        return lines;
      });
  module.def("find_missing_effects", &search, py::arg("model"), py::arg("recordings"), py::kw_only(),
             py::arg("held_out") = std::vector<Recording>(), py::arg("seed") = 1,
             py::arg("progress") = nullptr,
             R"(Compares a drive model with recordings, and names and adds the effects that it lacks.

held_out: recordings that judge the result; without them, stretches of `recordings` are held out.
progress: called with the name of the present step and the completed share, 0 to 1.)");
}

}  // namespace

void add_gap(py::module_& module) {
  add_fit(module);
  add_search(module);
}

}  // namespace youbot_python
