// MCAP files of others, as recordings and for the repair.
#include <cmath>
#include <string>
#include <string_view>

#include "runtime/mcap/compression.h"
#include "runtime/mcap/mcap_reader.h"
#include "runtime/mcap/mcap_writer.h"
#include "runtime/mcap/recording_writer.h"
#include "runtime/mcap/recover.h"
#include "runtime/mcap/ros_messages.h"
#include "runtime/recording/recording_reader.h"
#include "tests/fuzz/fuzz_target.h"

using fuzz::require;
using namespace runtime::mcap;

namespace {

void write_recording(McapWriter& writer) {
  RecordingWriter recording(
      writer, {{{"rig", "wheel-1"}}, {{"time_s", 3}, {"position_rad"}, {"torque_measured_Nm", 6}}});
  for (int i = 0; i < 3; ++i) recording.append_row(std::vector<double>{i * 0.001, i * 0.1, -i * 0.01});
  recording.end_block();
}

void write_joint_states(McapWriter& writer) {
  const std::uint16_t schema = writer.add_schema(kJointStateType, "ros2msg", kJointStateDefinition);
  const std::uint16_t channel = writer.add_channel(schema, "/joint_states", "cdr", {});
  for (std::uint32_t i = 1; i < 4; ++i) {
    CdrWriter cdr;
    write(cdr, JointState{{0, i}, "base", {"a"}, {1}, {2}, {3}});
    writer.add_message({channel, i, i, i, cdr.payload()});
  }
}

std::string chunked(Compression compression) {
  std::string file;
  McapWriter writer([&file](std::string_view part) { file += part; },
                    {.library = "fuzz", .compression = compression});
  write_recording(writer);
  writer.add_attachment({.name = "config.toml", .media_type = "application/toml", .data = "a = 1"});
  writer.finish();
  return file;
}

/// Without chunks and checksums, so that mutations reach the messages.
std::string unchunked(void (*write_content)(McapWriter&)) {
  std::string file;
  McapWriter writer([&file](std::string_view part) { file += part; },
                    {.library = "fuzz", .compression = Compression::kNone});
  write_content(writer);
  const std::size_t chunk = file.size();
  writer.end_chunk();
  constexpr std::size_t kChunkHead = kRecordHeadBytes + 8 + 8 + 8 + 4 + 4 + 8;
  file.erase(chunk, kChunkHead);
  return file + std::string("\x0f\x04\0\0\0\0\0\0\0\0\0\0\0", 13);
}

struct Count : Visitor {
  std::uint64_t messages = 0;
  void message(const Message&) override { ++messages; }
};

}  // namespace

std::vector<fuzz::Bytes> fuzz::seeds() {
  std::vector<Bytes> result;
  for (const std::string& file :
       {chunked(Compression::kNone), chunked(Compression::kZstd), chunked(Compression::kLz4),
        unchunked(write_recording), unchunked(write_joint_states)})
    result.emplace_back(file.begin(), file.end());
  return result;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::Bytes copy(data, data + size);
  const std::string_view bytes(reinterpret_cast<const char*>(copy.data()), copy.size());
  try {
    const runtime::ReadRecording read = runtime::parse_mcap_recording(bytes, "f.mcap", {.joint = {}});
    require(read.recording.rows() > 0);
    for (const auto& column : read.recording.columns) {
      require(column.values.size() == read.recording.rows());
      for (const double value : column.values) require(std::isfinite(value));
    }
    const auto time = read.recording.column("time_s");
    for (std::size_t i = 1; i < time.size(); ++i) require(time[i] > time[i - 1]);
  } catch (const runtime::RecordingError& error) {
    require(!error.problems().empty());
  }
  try {
    std::string whole;
    const Recovered recovered = recover([bytes] { return read_from(bytes); }, "f.mcap", "fuzz",
                                        [&whole](std::string_view part) { whole += part; });
    Count count;
    read_mcap(read_from(whole), "whole", count);
    require(count.messages == recovered.messages);
  } catch (const McapError& error) {
    require(error.offset() <= size);
  }
  return 0;
}
