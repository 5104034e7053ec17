// What is kept of a traced tile, and its bytes.

#include "prt/tile_record.h"

#include <xxhash.h>

#include <cstring>

#include "prt/prior_lighting.h"

namespace haarlight {
namespace {

struct RecordHeader {
  std::uint32_t tile;
  std::uint32_t rgb_blocks;
  std::uint64_t present, scales, values, errors, noises, pictures;  ///< counts of what follows
  std::uint64_t hash;  ///< XXH3 of the header with this zero, and of the payload
};
static_assert(sizeof(RecordHeader) == kRecordHeaderBytes);

constexpr std::uint64_t kRowBytes = kTileRows * (sizeof(Rgb) + sizeof(float));

std::uint64_t payload_size(const RecordHeader& h) {
  return h.present + 2 * h.scales + h.values + 16 * (h.errors + h.noises) + 8 * h.pictures +
         kRowBytes;
}

RecordHeader header_of(std::span<const std::byte> bytes) {
  RecordHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  return header;
}

std::uint64_t hash_of(RecordHeader header, std::span<const std::byte> payload) {
  header.hash = 0;
  const std::uint64_t seed = XXH3_64bits(&header, sizeof header);
  return XXH3_64bits_withSeed(payload.data(), payload.size(), seed);
}

template <typename T>
void append_bytes(std::vector<std::byte>& to, const std::vector<T>& values) {
  const std::size_t begin = to.size(), size = values.size() * sizeof(T);
  to.resize(begin + size);
  if (size > 0) std::memcpy(to.data() + begin, values.data(), size);
}

template <typename T>
const std::byte* take(const std::byte* from, std::vector<T>& values, std::uint64_t count) {
  values.resize(count);
  if (count > 0) std::memcpy(static_cast<void*>(values.data()), from, count * sizeof(T));
  return from + count * sizeof(T);
}

}  // namespace

TileRecord make_tile_record(const HaarLayout& layout, int tile, const TileRows& rows,
                            std::span<const float> thresholds) {
  TileRecord record;
  record.tile = compress_tile(layout, rows, thresholds);
  record.color = rows.color;
  record.coverage = rows.coverage;
  record.noise = {rows.noise_variance, rows.noise_energy};
  if (tile % kMeasureEvery == 0) {
    const auto& lightings = prior_lightings(layout);
    record.pictures = tile_pictures(layout, rows.values, rows.rgb_blocks, lightings);
    record.error = tile_error(layout, record.pictures, record.tile, record.color, lightings);
  }
  return record;
}

std::vector<std::byte> pack_record(int tile, const TileRecord& record) {
  RecordHeader header{};
  header.tile = static_cast<std::uint32_t>(tile);
  header.rgb_blocks = record.tile.rgb_blocks;
  header.present = record.tile.present.size();
  header.scales = record.tile.scales.size();
  header.values = record.tile.values.size();
  header.errors = record.error.error.size();
  header.pictures = record.pictures.size();
  header.noises = record.noise.error.size();
  std::vector<std::byte> bytes(sizeof header);
  bytes.reserve(sizeof header + payload_size(header));
  append_bytes(bytes, record.tile.present);
  append_bytes(bytes, record.tile.scales);
  append_bytes(bytes, record.tile.values);
  append_bytes(bytes, record.error.error);
  append_bytes(bytes, record.error.energy);
  append_bytes(bytes, record.noise.error);
  append_bytes(bytes, record.noise.energy);
  append_bytes(bytes, record.pictures);
  append_bytes(bytes, record.color);
  append_bytes(bytes, record.coverage);
  header.hash = hash_of(header, std::span(bytes).subspan(sizeof header));
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

std::optional<std::uint64_t> packed_record_size(std::span<const std::byte> header, int tiles,
                                                std::uint64_t left) {
  if (header.size() < sizeof(RecordHeader)) return std::nullopt;
  const RecordHeader h = header_of(header);
  // Each count by itself first, so that the sum cannot wrap.
  if (h.tile >= static_cast<std::uint32_t>(tiles) || h.present > left || h.scales > left ||
      h.values > left || h.errors > left || h.noises > left || h.pictures > left ||
      payload_size(h) > left) {
    return std::nullopt;
  }
  return sizeof h + payload_size(h);
}

int packed_record_tile(std::span<const std::byte> bytes) {
  return static_cast<int>(header_of(bytes).tile);
}

bool packed_record_is_whole(std::span<const std::byte> bytes) {
  const RecordHeader header = header_of(bytes);
  return hash_of(header, bytes.subspan(sizeof header)) == header.hash;
}

std::optional<TileRecord> unpack_record(std::span<const std::byte> bytes) {
  if (bytes.size() < sizeof(RecordHeader)) return std::nullopt;
  const RecordHeader header = header_of(bytes);
  const std::uint64_t left = bytes.size() - sizeof header;
  if (header.present > left || header.scales > left || header.values > left ||
      header.errors > left || header.noises > left || header.pictures > left ||
      payload_size(header) != left || !packed_record_is_whole(bytes)) {
    return std::nullopt;
  }
  TileRecord record;
  record.tile.rgb_blocks = header.rgb_blocks;
  const std::byte* from = bytes.data() + sizeof header;
  from = take(from, record.tile.present, header.present);
  from = take(from, record.tile.scales, header.scales);
  from = take(from, record.tile.values, header.values);
  from = take(from, record.error.error, header.errors);
  from = take(from, record.error.energy, header.errors);
  from = take(from, record.noise.error, header.noises);
  from = take(from, record.noise.energy, header.noises);
  from = take(from, record.pictures, header.pictures);
  from = take(from, record.color, kTileRows);
  take(from, record.coverage, kTileRows);
  return record;
}

}  // namespace haarlight
