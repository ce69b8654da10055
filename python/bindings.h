/// @file
/// The parts of the Python module; each is in the file of the same name.
#pragma once
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <youbot/friction.h>

#include <string>
#include <vector>

namespace youbot_python {

namespace py = pybind11;

/// An array of numbers, or a single number.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Wrapper of an effect for Python: AnyEffect is a variant, whose alternatives pybind11 would convert one by
/// one.
struct Effect {
  model::effects::AnyEffect any;
};
std::vector<Effect> wrapped(const std::vector<model::effects::AnyEffect>& effects);

/// Values by name, from keyword arguments. The names live as long as the dictionary.
std::vector<model::NamedValue> named_values(const py::kwargs& values);

void add_friction(py::module_& module);   // laws, drive models, compensation
void add_recording(py::module_& module);  // recordings
void add_gap(py::module_& module);        // fits and the search for missing effects
void add_robot(py::module_& module);      // the robot

}  // namespace youbot_python
