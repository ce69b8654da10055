// Friction laws, drive models and compensation.
#include <youbot/friction.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <variant>

#include "model/effects/basis.h"
#include "python/bindings.h"
#include "sim/model_drive.h"

namespace youbot_python {
namespace {

using model::effects::EffectChain;
using model::friction::LawDescription;
using youbot::AnyLaw;
using youbot::DriveModel;

py::dict dict_of(std::span<const model::ParameterDescription> parameters, const auto& value_of) {
  py::dict values;
  for (const model::ParameterDescription& parameter : parameters)
    values[py::str(std::string(parameter.name))] = value_of(parameter.name);
  return values;
}

/// Applies `of` to each number.
template <class Of>
py::object of_each(const Numbers& x, const Of& of) {
  return py::vectorize([&of](double value) { return of(value); })(x);
}

/// Values of a one-dimensional array; Python must not change it while the view is in use.
std::span<const double> values_of(const Numbers& numbers, const char* name) {
  if (numbers.ndim() != 1) throw std::invalid_argument(std::string(name) + " must be one-dimensional");
  return {numbers.data(), static_cast<std::size_t>(numbers.size())};
}

double positive(double value, const char* name) {
  if (value > 0 && std::isfinite(value)) return value;
  throw std::invalid_argument(std::string(name) + " must be above 0");
}

py::array_t<double> law_torques(const AnyLaw& law, const Numbers& velocity, double period_s,
                                double applied_Nm) {
  const std::span<const double> velocities = values_of(velocity, "velocity_rad_per_s");
  positive(period_s, "period_s");
  py::array_t<double> torques(velocity.size());
  model::friction::State state;
  for (std::size_t i = 0; i < velocities.size(); ++i)
    torques.mutable_data()[i] =
        law.step(state, {.velocity_rad_per_s = velocities[i], .applied_torque_Nm = applied_Nm}, period_s);
  return torques;
}

py::dict simulated(const DriveModel& model, const Numbers& torque, double period_s, double position_rad) {
  const std::span<const double> given = values_of(torque, "torque_command_Nm");
  const std::vector<double> command_Nm(given.begin(), given.end());  // Python may change its own meanwhile
  sim::ModelDrive drive(model, positive(period_s, "period_s"));
  drive.set_position(position_rad);
  py::array_t<double> time(torque.size());
  py::array_t<double> position(torque.size());
  py::array_t<double> velocity(torque.size());
  py::array_t<double> reported(torque.size());
  double* const into[] = {time.mutable_data(), position.mutable_data(), velocity.mutable_data(),
                          reported.mutable_data()};
  {
    const py::gil_scoped_release release;
    for (std::size_t i = 0; i < command_Nm.size(); ++i) {
      into[0][i] = static_cast<double>(i) * period_s;
      into[1][i] = drive.position_rad();
      into[2][i] = drive.velocity_rad_per_s();
      drive.step(command_Nm[i]);
      into[3][i] = drive.reported_Nm();
    }
  }
  py::dict columns;
  columns["time_s"] = time;
  columns["torque_command_Nm"] = py::array_t<double>(torque.size(), command_Nm.data());
  columns["torque_measured_Nm"] = reported;
  columns["position_rad"] = position;
  columns["velocity_rad_per_s"] = velocity;
  return columns;
}

/// Observer and compensator of one joint.
class Compensation {
 public:
  Compensation(const std::variant<int, DriveModel>& of, double margin, double full_command_Nm,
               double period_s)
      : compensator_({.margin = margin, .full_command_Nm = full_command_Nm}),
        observer_(observer(of, period_s)) {}

  void reset(double position_rad) { observer_.reset(position_rad); }
  double step(double command_Nm, double position_rad) {
    return compensator_.torque_Nm(command_Nm, observer_.step(position_rad), observer_);
  }

 private:
  static youbot::FrictionObserver observer(const std::variant<int, DriveModel>& of, double period_s) {
    youbot::FrictionObserver::Config config;
    config.filter.period_s = period_s;
    if (const int* wheel = std::get_if<int>(&of))
      return youbot::FrictionObserver(youbot::wheel_table(*wheel), config);
    const youbot::JointResistance resistance = youbot::resistance_of(std::get<DriveModel>(of));
    return youbot::FrictionObserver(resistance.sliding, config, resistance.position);
  }

  youbot::FrictionCompensator compensator_;
  youbot::FrictionObserver observer_;
};

void write_model(const DriveModel& model, const std::filesystem::path& path) {
  std::ofstream file(path);
  file << youbot::drive_model_text(model);
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

void add_laws(py::module_& module) {
  py::class_<AnyLaw>(module, "Law",
                     R"(A friction law, selected by name: kfm, karnopp, dahl, lugre, leuven, gms, ...

    law = youbot.Law("lugre", coulomb_Nm=0.04)
    torque_Nm = law.torques_Nm(velocity_rad_per_s, period_s=1e-3))")
      .def(py::init([](const std::string& name, const py::kwargs& values) {
             return youbot::make_law(name, named_values(values));
           }),
           py::arg("name"))
      .def_property_readonly("name", [](const AnyLaw& law) { return std::string(law.name()); })
      .def_property_readonly("parameters",
                             [](const AnyLaw& law) {
                               return dict_of(model::friction::law_description(law.name()).parameters,
                                              [&](std::string_view name) { return law.parameter(name); });
                             })
      .def(
          "steady_Nm",
          [](const AnyLaw& law, const Numbers& velocity) {
            return of_each(velocity, [&law](double v) { return law.steady_Nm(v); });
          },
          py::arg("velocity_rad_per_s"), "Torque of a joint after long sliding at this velocity.")
      .def("torques_Nm", &law_torques, py::arg("velocity_rad_per_s"), py::arg("period_s"), py::kw_only(),
           py::arg("applied_torque_Nm") = 0.0,
           "Torque at the end of each period in which the joint moves at that velocity, starting from rest.");
  module.def("law_names", [] {
    std::vector<std::string> names;
    for (const LawDescription& law : model::friction::law_descriptions()) names.emplace_back(law.name);
    return names;
  });
}

void add_models(py::module_& module) {
  py::class_<Effect>(module, "Effect",
                     R"(One effect of a drive: coulomb, viscous, stribeck, cogging, backlash, ...

    youbot.Effect("coulomb", torque_Nm=0.05))")
      .def(py::init([](const std::string& name, const py::kwargs& values) {
             return Effect{youbot::make_effect(name, named_values(values))};
           }),
           py::arg("name"))
      .def_property_readonly("name",
                             [](const Effect& effect) { return std::string(youbot::name_of(effect.any)); })
      .def_property_readonly("parameters",
                             [](const Effect& effect) {
                               return dict_of(model::effects::description_of(effect.any).parameters,
                                              [&](std::string_view name) {
                                                return model::effects::parameter_of(effect.any, name);
                                              });
                             })
      .def("__repr__", [](const py::object& self) {
        return py::str("<Effect {} {}>").format(self.attr("name"), self.attr("parameters"));
      });
  module.def("effect_names", [] {
    std::vector<std::string> names;
    for (const auto& effect : model::effects::effect_descriptions()) names.emplace_back(effect.name);
    return names;
  });

  py::class_<DriveModel>(module, "DriveModel", R"(A drive: its inertia and its effects.

    model = youbot.DriveModel(0.011, [youbot.Effect("coulomb", torque_Nm=0.05)])
    motion = model.simulate(torque_command_Nm, period_s=1e-3))")
      .def(py::init([](double inertia_kg_m2, const std::vector<Effect>& effects, const std::string& name) {
             DriveModel model;
             model.name = name;
             model.inertia_kg_m2 = positive(inertia_kg_m2, "inertia_kg_m2");
             for (const Effect& effect : effects) model.effects.push_back(effect.any);
             return model;
           }),
           py::arg("inertia_kg_m2"), py::arg("effects") = std::vector<Effect>(), py::arg("name") = "")
      .def_static(
          "read", [](const std::filesystem::path& path) { return youbot::read_drive_model(path); },
          py::arg("path"), "Reads a model file. Raises FileError with file and line if it has a mistake.")
      .def("write", &write_model, py::arg("path"))
      .def_readonly("name", &DriveModel::name)
      .def_readonly("inertia_kg_m2", &DriveModel::inertia_kg_m2)
      .def_property_readonly(
          "effects", [](const DriveModel& model) { return wrapped(model.effects); }, "Copies.")
      .def(
          "sliding_torque_Nm",
          [](const DriveModel& model, const Numbers& velocity) {
            const EffectChain chain(model.effects);
            return of_each(velocity,
                           [&chain](double v) { return model::effects::sliding_torque_Nm(chain, v); });
          },
          py::arg("velocity_rad_per_s"),
          "Torque that keeps the joint at this velocity, when cold and at position 0.")
      .def(
          "simulate", &simulated, py::arg("torque_command_Nm"), py::arg("period_s"),
          py::arg("position_rad") = 0.0,
          R"(Simulates the motion from rest under these torques. Returns a dict of the columns of a recording.

A row has the position and velocity at the beginning of its period, and the torque that the sensor reports during it.)")
      .def("__str__", [](const DriveModel& model) { return youbot::drive_model_text(model); });
}

}  // namespace

std::vector<Effect> wrapped(const std::vector<model::effects::AnyEffect>& effects) {
  std::vector<Effect> result;
  for (const auto& effect : effects) result.push_back({effect});
  return result;
}

std::vector<model::NamedValue> named_values(const py::kwargs& values) {
  std::vector<model::NamedValue> result;
  for (const auto& [name, value] : values)
    result.push_back({py::cast<std::string_view>(name), py::cast<double>(value)});
  return result;
}

void add_friction(py::module_& module) {
  add_laws(module);
  add_models(module);
  py::class_<Compensation>(module, "FrictionCompensation",
                           R"(Compensation of the friction that opposes a commanded torque.

It never reverses a command and never drives a joint by itself.

    compensation = youbot.FrictionCompensation(1)       # of wheel 1, as measured; or of a DriveModel
    torque_Nm = command_Nm + compensation.step(command_Nm, state.position_rad[0]))")
      .def(py::init<const std::variant<int, DriveModel>&, double, double, double>(), py::arg("of"),
           py::kw_only(), py::arg("margin") = 0.95, py::arg("full_command_Nm") = 0.01,
           py::arg("period_s") = 1e-3)
      .def("reset", &Compensation::reset, py::arg("position_rad"))
      .def("step", &Compensation::step, py::arg("command_Nm"), py::arg("position_rad"),
           "Call once per period. Returns the torque to add to the command.");
}

}  // namespace youbot_python
