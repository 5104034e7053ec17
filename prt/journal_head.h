// What a journal of tiles says of itself at its beginning. Private to prt/.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "prt/transport.h"
#include "prt/transport_writer.h"

namespace haarlight {

/// All that is needed to put a file together from the journal alone.
struct JournalHead {
  TransportInfo info;  ///< without meta
  std::string fingerprint;
  std::vector<float> thresholds;  ///< per band
  std::string meta;               ///< as for TransportWriter::finish
  std::uint64_t max_bytes = 0;
  Shard shard;
  int tiles = 0;  ///< of the whole transport
};

/// Magic, sizes, checksum, JSON, packed mesh, view factors and clusters.
std::vector<std::byte> pack_head(const JournalHead& head);

/// Bytes of the fixed part, and of the whole head as it says; 0 if it is none of ours.
inline constexpr std::size_t kHeadFixedBytes = 32;
std::uint64_t packed_head_size(std::span<const std::byte> fixed);

/// Throws Error{format}, message beginning with `name`, unless `bytes` is a whole and right head.
JournalHead unpack_head(std::span<const std::byte> bytes, const std::string& name);

/// Whether tiles of one may go into the other: made from the same input in the same way. Says
/// nothing of shards, and nothing of meta, which may name another folder.
bool same_run(const JournalHead& a, const JournalHead& b);

}  // namespace haarlight
