// Transports and shards from any bytes.

#include "prt/transport.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "prt/picture_relighter.h"
#include "prt/tile_journal.h"
#include "prt/transport_format.h"
#include "prt/transport_merge.h"
#include "tests/fuzz/targets.h"

namespace haarlight::fuzz {
namespace {

/// So that reading is not left out.
volatile std::uint64_t read_so_far;

// Reads all that a reader may read; relights what is small enough to be quick.
void use_transport(const std::filesystem::path& file) {
  const Transport t = Transport::open(file);
  std::uint64_t sum = 0;
  for (int c = 0; c < t.chunk_count(); ++c) {
    for (int j = 0; j < t.layout().size(); ++j) {
      const ColumnBlocks blocks = t.column(c, j);
      if (!blocks.present) continue;
      int scales = 0;
      for (int w = 0; w < 4; ++w) {
        scales += std::popcount(blocks.present[w]) +
                  2 * std::popcount(blocks.present[w] & t.rgb_blocks(c)[w]);
      }
      for (int s = 0; s < scales; ++s) sum += blocks.scales[s];
      for (int v = 0; v < 16 * scales; ++v) sum += static_cast<std::uint64_t>(blocks.values[v]);
    }
  }
  read_so_far = sum;
  const std::int64_t pixels = std::int64_t{t.width()} * t.height();
  const bool drawable = t.kind() == TransportKind::image ||
                        (t.kind() == TransportKind::mesh && (t.info().terms == 1 || t.info().view));
  if (!drawable || pixels > 65536 || t.rows() > 65536) return;
  PictureRelighter relighter(t);
  LightingUpdate update;
  for (int j = 0; j < t.layout().size(); ++j) update.deltas.push_back({j, RgbD(1, -2, 0.5)});
  relighter.apply(update);
}

void put_hash(std::vector<std::byte>& bytes, FileSection& section) {
  if (section.offset > bytes.size()) return;
  section.size = std::min<std::uint64_t>(section.size, bytes.size() - section.offset);
  section.hash = XXH3_64bits(bytes.data() + section.offset, section.size);
}

// Hashes of the sections named in a table of entries that end in a FileSection.
template <typename Entry>
void put_hashes(std::vector<std::byte>& bytes, const FileSection& table) {
  if (table.offset > bytes.size()) return;
  const std::uint64_t size = std::min<std::uint64_t>(table.size, bytes.size() - table.offset);
  for (std::uint64_t at = 0; at + sizeof(Entry) <= size && at < 64 * sizeof(Entry);
       at += sizeof(Entry)) {
    std::byte* place = bytes.data() + table.offset + at + sizeof(Entry) - sizeof(FileSection);
    FileSection section;
    std::memcpy(&section, place, sizeof section);
    put_hash(bytes, section);
    std::memcpy(place, &section, sizeof section);
  }
}

}  // namespace

std::vector<std::byte> with_right_checksums(Bytes from) {
  std::vector<std::byte> bytes(from.begin(), from.end());
  TransportHeader header;
  if (bytes.size() < sizeof header) return bytes;
  std::memcpy(&header, bytes.data(), sizeof header);
  std::memcpy(header.magic, kTransportMagic, sizeof header.magic);
  header.version = kTransportVersion;
  header.file_size = bytes.size();
  put_hashes<FileSection>(bytes, header.chunk_table);
  put_hashes<NamedSection>(bytes, header.named);
  for (FileSection* section : {&header.meta, &header.rows, &header.column_norms,
                               &header.chunk_table, &header.mesh, &header.named}) {
    put_hash(bytes, *section);
  }
  header.header_hash = XXH3_64bits(&header, offsetof(TransportHeader, header_hash));
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

Outcome transport_as_it_is(Bytes bytes) { return with_file("fuzz.hlt", bytes, use_transport); }

Outcome transport(Bytes bytes) {
  const Outcome outcome = transport_as_it_is(bytes);
  transport_as_it_is(with_right_checksums(bytes));
  return outcome;
}

std::vector<std::byte> journal_with_right_checksums(Bytes from) {
  std::vector<std::byte> bytes(from.begin(), from.end());
  const std::uint64_t head = packed_head_size(bytes);
  if (head == 0 || head > bytes.size()) return bytes;
  const std::uint64_t hash = XXH3_64bits(bytes.data() + kHeadFixedBytes, head - kHeadFixedBytes);
  std::memcpy(bytes.data() + kHeadFixedBytes - sizeof hash, &hash, sizeof hash);
  for (std::uint64_t at = head; at + kRecordHeaderBytes <= bytes.size();) {
    const std::span<std::byte> record = std::span(bytes).subspan(at);
    const auto size = packed_record_size(record, 1 << 20, record.size() - kRecordHeaderBytes);
    if (!size) break;
    std::byte* place = record.data() + kRecordHeaderBytes - sizeof hash;
    std::memset(place, 0, sizeof hash);
    const std::uint64_t seed = XXH3_64bits(record.data(), kRecordHeaderBytes);
    const std::uint64_t right =
        XXH3_64bits_withSeed(record.data() + kRecordHeaderBytes, *size - kRecordHeaderBytes, seed);
    std::memcpy(place, &right, sizeof right);
    at += *size;
  }
  return bytes;
}

Outcome journal_as_it_is(Bytes bytes) {
  return with_file("fuzz.hlt.partial", bytes, [](const std::filesystem::path& file) {
    const TileJournal journal(file);
    for (int tile = 0; tile < std::min(journal.head().tiles, 64); ++tile) journal.read(tile);
    const std::filesystem::path parts[] = {file};
    const std::filesystem::path joined = file.string() + ".joined";
    merge_transport(joined, parts);
    use_transport(joined);
  });
}

Outcome journal(Bytes bytes) {
  const Outcome outcome = journal_as_it_is(bytes);
  journal_as_it_is(journal_with_right_checksums(bytes));
  return outcome;
}

}  // namespace haarlight::fuzz
