#include "ros2/raw_topic.h"

#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "hal/setup_error.h"

namespace ros2 {
namespace {

/// Cyclone DDS calls a type and its samples through tables of functions, in the way of C: both inherit its
/// structs, and are freed by its reference counts.
struct RawType : ddsi_sertype {
  std::size_t max_received_bytes = 0;
};

struct RawSample : ddsi_serdata {
  std::string bytes;  // with zeros to a multiple of four, as the network needs
  std::uint32_t size = 0;

  std::string_view payload() const { return {bytes.data(), size}; }
};

RawSample& raw(ddsi_serdata* sample) { return *static_cast<RawSample*>(sample); }
const RawSample& raw(const ddsi_serdata* sample) { return *static_cast<const RawSample*>(sample); }

std::unique_ptr<RawSample> make_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t size) {
  auto sample = std::make_unique<RawSample>();
  ddsi_serdata_init(sample.get(), type, kind);
  sample->hash = type->serdata_basehash;
  sample->size = static_cast<std::uint32_t>(size);
  sample->bytes.assign((size + 3) / 4 * 4, '\0');
  return sample;
}

bool is_too_long(const ddsi_sertype* type, std::size_t size) {
  return size > static_cast<const RawType*>(type)->max_received_bytes;
}

/// Fragments are in order and may overlap.
ddsi_serdata* from_network(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment,
                           std::size_t size) {
  if (is_too_long(type, size)) return nullptr;
  auto sample = make_sample(type, kind, size);
  std::size_t used = 0;
  for (; fragment != nullptr && used < size; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= used) continue;
    if (fragment->min > used) return nullptr;
    const unsigned char* const bytes =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment)) + (used - fragment->min);
    const std::size_t more = std::min<std::size_t>(fragment->maxp1, size) - used;
    std::memcpy(sample->bytes.data() + used, bytes, more);
    used += more;
  }
  return used == size ? sample.release() : nullptr;
}

ddsi_serdata* from_pieces(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                          const ddsrt_iovec_t* pieces, std::size_t size) {
  if (is_too_long(type, size)) return nullptr;
  auto sample = make_sample(type, kind, size);
  std::size_t used = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < count && used < size; ++i) {
    const std::size_t more = std::min<std::size_t>(pieces[i].iov_len, size - used);
    std::memcpy(sample->bytes.data() + used, pieces[i].iov_base, more);
    used += more;
  }
  return used == size ? sample.release() : nullptr;
}

/// Without a key, all samples belong to the one instance.
ddsi_serdata* of_the_instance(const ddsi_serdata* sample) {
  auto key = make_sample(sample->type, SDK_KEY, 0);
  key->type = nullptr;
  return key.release();
}

constexpr ddsi_serdata_ops kSampleFunctions = [] {
  ddsi_serdata_ops functions{};
  functions.eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; };
  functions.get_size = [](const ddsi_serdata* sample) { return raw(sample).size; };
  functions.from_ser = from_network;
  functions.from_ser_iov = from_pieces;
  functions.from_keyhash = [](const ddsi_sertype* type, const ddsi_keyhash*) -> ddsi_serdata* {
    return make_sample(type, SDK_KEY, 0).release();
  };
  // Samples of C structs: there are none.
  functions.from_sample = [](const ddsi_sertype*, ddsi_serdata_kind, const void*) -> ddsi_serdata* {
    return nullptr;
  };
  functions.to_sample = [](const ddsi_serdata*, void*, void**, void*) { return false; };
  functions.untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) {
    return false;
  };
  functions.to_ser = [](const ddsi_serdata* sample, std::size_t offset, std::size_t size, void* to) {
    std::memcpy(to, raw(sample).bytes.data() + offset, size);
  };
  functions.to_ser_ref = [](const ddsi_serdata* sample, std::size_t offset, std::size_t size,
                            ddsrt_iovec_t* reference) {
    ddsi_serdata* const kept = ddsi_serdata_ref(sample);
    *reference = {.iov_base = raw(kept).bytes.data() + offset, .iov_len = size};
    return kept;
  };
  functions.to_ser_unref = [](ddsi_serdata* sample, const ddsrt_iovec_t*) { ddsi_serdata_unref(sample); };
  functions.to_untyped = of_the_instance;
  functions.free = [](ddsi_serdata* sample) { delete &raw(sample); };
  functions.print = [](const ddsi_sertype*, const ddsi_serdata*, char* text,
                       std::size_t size) -> std::size_t {
    if (size > 0) *text = '\0';
    return 0;
  };
  functions.get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* key, bool) { *key = {}; };
  return functions;
}();

constexpr ddsi_sertype_ops kTypeFunctions = [] {
  ddsi_sertype_ops functions{};
  functions.version = ddsi_sertype_v0;
  functions.free = [](ddsi_sertype* type) {
    ddsi_sertype_fini(type);
    delete static_cast<RawType*>(type);
  };
  functions.equal = [](const ddsi_sertype* a, const ddsi_sertype* b) {
    return static_cast<const RawType*>(a)->max_received_bytes ==
           static_cast<const RawType*>(b)->max_received_bytes;
  };
  functions.hash = [](const ddsi_sertype*) { return std::uint32_t{0}; };
  // Samples of C structs: there are none.
  functions.zero_samples = [](const ddsi_sertype*, void*, std::size_t) {};
  functions.realloc_samples = [](void** samples, const ddsi_sertype*, void*, std::size_t, std::size_t) {
    *samples = nullptr;
  };
  functions.free_samples = [](const ddsi_sertype*, void**, std::size_t, dds_free_op_t) {};
  return functions;
}();

}  // namespace

RawTopic make_raw_topic(dds_entity_t participant, const std::string& name, const std::string& type,
                        std::size_t max_received_bytes) {
  auto* const made = new RawType{};
  ddsi_sertype_init_flags(made, type.c_str(), &kTypeFunctions, &kSampleFunctions,
                          DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY);
  made->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  made->max_received_bytes = max_received_bytes;
  ddsi_sertype* registered = made;  // or an equal one that is there already
  const dds_entity_t topic =
      dds_create_topic_sertype(participant, name.c_str(), &registered, nullptr, nullptr, nullptr);
  if (topic < 0) {
    ddsi_sertype_unref(made);
    throw hal::SetupError("DDS topic " + name, dds_strretcode(topic), "check the domain of --ros2");
  }
  return {topic, registered};
}

dds_return_t write_raw(dds_entity_t writer, const RawTopic& topic, std::string_view payload) {
  auto sample = make_sample(topic.type, SDK_DATA, payload.size());
  std::memcpy(sample->bytes.data(), payload.data(), payload.size());
  return dds_writecdr(writer, sample.release());
}

void take_raw(dds_entity_t reader,
              const std::function<void(dds_instance_handle_t publisher, std::string_view payload)>& visit) {
  std::array<ddsi_serdata*, kMaxTaken> samples{};
  std::array<dds_sample_info_t, kMaxTaken> infos{};
  const dds_return_t count = dds_takecdr(reader, samples.data(), kMaxTaken, infos.data(), DDS_ANY_STATE);
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (infos[at].valid_data) visit(infos[at].publication_handle, raw(samples[at]).payload());
    ddsi_serdata_unref(samples[at]);
  }
}

}  // namespace ros2
