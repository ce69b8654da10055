// Recordings as columns of numpy arrays.
#include <youbot/recording.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "python/bindings.h"

namespace youbot_python {
namespace {

using youbot::Recording;

/// A view of the recording's own memory, which `owner` keeps alive.
py::array column(const py::object& owner, const std::string& name) {
  const std::span<const double> values = owner.cast<const Recording&>().column(name);
  py::array view(py::dtype::of<double>(), {values.size()}, {sizeof(double)}, values.data(), owner);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

Recording from_columns(const py::dict& columns, const std::string& rig, const std::string& experiment) {
  Recording recording;
  recording.rig = rig;
  recording.experiment = experiment;
  for (const auto& [name, values] : columns) {
    const auto numbers = values.cast<Numbers>();
    if (numbers.ndim() != 1)
      throw std::invalid_argument("column " + name.cast<std::string>() + ": not one-dimensional");
    recording.columns.push_back(
        {name.cast<std::string>(), std::vector<double>(numbers.data(), numbers.data() + numbers.size())});
    if (recording.columns.back().values.size() != recording.rows())
      throw std::invalid_argument("column " + recording.columns.back().name + " has " +
                                  std::to_string(recording.columns.back().values.size()) + " values, and " +
                                  recording.columns.front().name + " has " +
                                  std::to_string(recording.rows()));
  }
  return recording;
}

Recording read(const std::filesystem::path& path, const std::string& joint) {
  youbot::ReadRecording read = [&] {
    const py::gil_scoped_release release;
    return youbot::read_recording(path, runtime::ReadOptions{.joint = joint});
  }();
  const py::object warn = py::module_::import("warnings").attr("warn");
  for (const std::string& warning : read.warnings) warn(warning);
  return std::move(read.recording);
}

void write(const Recording& recording, const std::filesystem::path& path) {
  std::vector<youbot::RecordingFile::Comment> comments;
  const auto say = [&](const std::string& key, const std::string& value) {
    const auto same = [&key](const auto& comment) { return comment.first == key; };
    if (!value.empty() && std::ranges::none_of(recording.comments, same)) comments.push_back({key, value});
  };
  say("rig", recording.rig);
  say("experiment", recording.experiment);
  for (const auto& [key, value] : recording.comments) comments.push_back({key, value});
  std::vector<youbot::RecordingFile::Column> columns;
  for (const Recording::Column& column : recording.columns) columns.push_back({column.name});
  youbot::RecordingFile file(path, comments, columns);
  std::vector<double> row(columns.size());
  for (std::size_t i = 0; i < recording.rows(); ++i) {
    for (std::size_t k = 0; k < row.size(); ++k) row[k] = recording.columns[k].values[i];
    file.append_row(row);
  }
  file.close();
  if (const std::string problem = file.error(); !problem.empty()) throw std::runtime_error(problem);
}

}  // namespace

void add_recording(py::module_& module) {
  py::class_<Recording>(module, "Recording",
                        R"(Columns of equal length by name, with the unit at the end of each name.

    recording = youbot.read_recording("wheel-1.csv")
    plt.plot(recording["time_s"], recording["position_rad"]))")
      .def(py::init(&from_columns), py::arg("columns"), py::kw_only(), py::arg("rig") = "",
           py::arg("experiment") = "", "Creates a recording from a dict of arrays.")
      .def_readonly("rig", &Recording::rig)
      .def_readonly("experiment", &Recording::experiment)
      .def_readonly("comments", &Recording::comments, "All header lines as pairs of key and value.")
      .def_property_readonly("names",
                             [](const Recording& recording) {
                               std::vector<std::string> names;
                               for (const Recording::Column& column : recording.columns)
                                 names.push_back(column.name);
                               return names;
                             })
      .def("__len__", &Recording::rows)
      .def("__contains__", &Recording::has)
      .def(
          "__getitem__",
          [](const py::object& self, const std::string& name) {
            try {
              return column(self, name);
            } catch (const std::invalid_argument& error) {
              throw py::key_error(error.what());
            }
          },
          "A read-only view of a column, not a copy.")
      .def("write", &write, py::arg("path"), "Writes a new file. Does not replace an existing one.")
      .def("__repr__", [](const Recording& recording) {
        return "<Recording of '" + recording.rig + "', " + std::to_string(recording.rows()) + " rows, " +
               std::to_string(recording.columns.size()) + " columns>";
      });
  module.def(
      "read_recording", &read, py::arg("path"), py::arg("joint") = "",
      "Reads a recording. Warns about parts that were left out. Raises FileError with file and line if the "
      "file has a mistake. joint: of an MCAP file with several, such as wheel_1; "
      "without it, a recording of ours has all columns.");
}

}  // namespace youbot_python
