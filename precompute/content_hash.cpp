// Hashes plain values, for fingerprints of scenes and options.

#include "precompute/content_hash.h"

#include <fmt/format.h>
#include <xxhash.h>

namespace haarlight {

ContentHash::ContentHash() : state_(XXH3_createState()) { XXH3_128bits_reset(state_); }
ContentHash::~ContentHash() { XXH3_freeState(state_); }

void ContentHash::add_bytes(const void* bytes, std::size_t size) {
  XXH3_128bits_update(state_, bytes, size);
}

std::string ContentHash::text() const {
  const XXH128_hash_t h = XXH3_128bits_digest(state_);
  return fmt::format("{:016x}{:016x}", h.high64, h.low64);
}

}  // namespace haarlight
