// The Python module `youbot`: the part of the library for notebooks.
#include <youbot/recording.h>
#include <youbot/robot.h>

#include "python/bindings.h"

PYBIND11_MODULE(youbot, module) {
  module.doc() =
      R"(youbot-hal for Python: robots, friction models, recordings and the search for missing effects.

SI units at the gearbox output: rad, rad/s, N·m, s. Arrays are numpy arrays.)";
  pybind11::register_exception<youbot::SetupError>(module, "SetupError", PyExc_RuntimeError);
  pybind11::register_exception<runtime::ConfigError>(module, "FileError", PyExc_ValueError);
  youbot_python::add_recording(module);
  youbot_python::add_friction(module);
  youbot_python::add_gap(module);
  youbot_python::add_robot(module);
}
