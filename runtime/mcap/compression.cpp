#include "runtime/mcap/compression.h"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <stdexcept>

namespace runtime::mcap {
namespace {

/// Of blocks of rows, level 1 saves 5 % less, and levels above 5 cost several times the time and save 1 %
/// more.
constexpr int kZstdLevel = 3;
/// The output grows step by step: a stated size alone reserves no memory.
constexpr std::size_t kOutputPieceBytes = std::size_t{64} << 10;

/// Extends `out` by room for the next piece and returns its size.
std::size_t make_room(std::string& out, std::uint64_t limit) {
  const std::size_t used = out.size();
  // One more byte than allowed, so that an excess shows.
  out.resize(static_cast<std::size_t>(std::min<std::uint64_t>(used + kOutputPieceBytes, limit + 1)));
  return out.size() - used;
}

void require_limit(const std::string& out, std::uint64_t limit) {
  if (out.size() > limit)
    throw std::runtime_error("the chunk contains more than the " + std::to_string(limit) +
                             " bytes that it states");
}

std::string decompress_zstd(std::string_view bytes, std::uint64_t limit) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          ZSTD_freeDStream);
  if (!stream) throw std::runtime_error("zstd: no memory");
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  std::string out;
  for (bool full = true; in.pos < in.size || full;) {
    const std::size_t used = out.size();
    const std::size_t room = make_room(out, limit);
    ZSTD_outBuffer piece{out.data() + used, room, 0};
    const std::size_t result = ZSTD_decompressStream(stream.get(), &piece, &in);
    out.resize(used + piece.pos);
    if (ZSTD_isError(result) != 0)
      throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(result));
    require_limit(out, limit);
    full = piece.pos == room;
    if (result == 0 && in.pos == in.size) break;
  }
  return out;
}

std::string decompress_lz4(std::string_view bytes, std::uint64_t limit) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0)
    throw std::runtime_error("lz4: no memory");
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> owner(
      context, LZ4F_freeDecompressionContext);
  std::string out;
  for (bool full = true; !bytes.empty() || full;) {
    const std::size_t used = out.size();
    const std::size_t room = make_room(out, limit);
    std::size_t written = room;
    std::size_t taken = bytes.size();
    const std::size_t result =
        LZ4F_decompress(context, out.data() + used, &written, bytes.data(), &taken, nullptr);
    out.resize(used + written);
    if (LZ4F_isError(result) != 0) throw std::runtime_error(std::string("lz4: ") + LZ4F_getErrorName(result));
    require_limit(out, limit);
    bytes.remove_prefix(taken);
    full = written == room;
    if ((result == 0 && bytes.empty()) || (taken == 0 && written == 0)) break;
  }
  return out;
}

}  // namespace

std::string_view name(Compression compression) noexcept {
  switch (compression) {
    case Compression::kNone: return "";
    case Compression::kLz4: return "lz4";
    case Compression::kZstd: return "zstd";
  }
  return "";
}

std::string compress(Compression compression, std::string_view bytes) {
  if (compression == Compression::kNone) return std::string(bytes);
  const bool zstd = compression == Compression::kZstd;
  std::string out(zstd ? ZSTD_compressBound(bytes.size()) : LZ4F_compressFrameBound(bytes.size(), nullptr),
                  '\0');
  const std::size_t size =
      zstd ? ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kZstdLevel)
           : LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr);
  if (zstd ? ZSTD_isError(size) != 0 : LZ4F_isError(size) != 0)
    throw std::runtime_error(std::string(name(compression)) + ": " +
                             (zstd ? ZSTD_getErrorName(size) : LZ4F_getErrorName(size)));
  out.resize(size);
  return out;
}

std::string decompress(std::string_view compression_name, std::string_view bytes, std::uint64_t limit) {
  if (compression_name == "zstd") return decompress_zstd(bytes, limit);
  if (compression_name == "lz4") return decompress_lz4(bytes, limit);
  if (!compression_name.empty())
    throw std::runtime_error("unknown compression '" + std::string(compression_name.substr(0, 40)) + "'");
  std::string out(bytes);
  require_limit(out, limit);
  return out;
}

}  // namespace runtime::mcap
