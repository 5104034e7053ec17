// What a place sees of one phase of the sky, by parts of its BSDF.

#include "precompute/sky_view.h"

#include <bit>

#include "core/simd.h"
#include "precompute/lanes.h"

namespace haarlight {
namespace {

using namespace lanes;
using Packet = SparseDirections::Packet;

constexpr std::size_t kMostCoats = 1024;  // kept: half a MB

float to_float(double x) { return static_cast<float>(x); }

// Cosines with the first of two normals, and which directions are above both horizons.
HAARLIGHT_MULTIVERSION
void find_above(const Packet* packet, std::size_t count, const float (&normals)[6], float* cosine,
                std::uint8_t* above) {
  const Vec8 n = all(normals[0], normals[1], normals[2]);
  const Vec8 g = all(normals[3], normals[4], normals[5]);
  for (std::size_t p = 0; p < count; ++p) {
    const Vec8 w = load(packet[p].x, packet[p].y, packet[p].z);
    const Eight c = dot(n, w);
    store(cosine + 8 * p, c);
    const EightInts up = (c > 0) & (dot(g, w) > 0) & (load(packet[p].weight) > 0);
    above[p] = static_cast<std::uint8_t>(mask_of(up));
  }
}

// cosine * weight * scale where a direction is open, times `pass` if there is one.
HAARLIGHT_MULTIVERSION
void weigh(const Packet* packet, std::uint64_t packets, const std::uint8_t* open,
           const float* cosine, const float* pass, float scale, float* values) {
  for (; packets != 0; packets &= packets - 1) {
    const auto p = static_cast<std::size_t>(std::countr_zero(packets));
    Eight v = load(cosine + 8 * p) * load(packet[p].weight) * scale;
    if (pass) v *= load(pass + 8 * p);
    store(values + 8 * p, lanes_of(open[p]) ? v : all(0));
  }
}

// values * weight where a direction is open.
HAARLIGHT_MULTIVERSION
void weigh_lobe(const Packet* packet, std::uint64_t packets, const std::uint8_t* open,
                float* values) {
  for (; packets != 0; packets &= packets - 1) {
    const auto p = static_cast<std::size_t>(std::countr_zero(packets));
    const Eight v = load(values + 8 * p) * load(packet[p].weight);
    store(values + 8 * p, lanes_of(open[p]) ? v : all(0));
  }
}

}  // namespace

void SkyView::look(const Visibility& visibility, const Vec3& from, const Bsdf& b,
                   const Packet* packets, std::size_t count, std::int64_t& rays,
                   Visibility::Surfaces see) {
  packets_ = packets;
  open_ = blocked_ = 0;
  const std::array<float, 3> start{to_float(from.x), to_float(from.y), to_float(from.z)};
  const float normals[6] = {to_float(b.normal.x),           to_float(b.normal.y),
                            to_float(b.normal.z),           to_float(b.geometric_normal.x),
                            to_float(b.geometric_normal.y), to_float(b.geometric_normal.z)};
  find_above(packets, count, normals, cosine_.data(), lanes_.data());
  for (std::size_t p = 0; p < count; ++p) {
    const unsigned lanes = lanes_[p];
    if (lanes == 0) continue;
    const Packet& d = packets[p];
    const unsigned blocked = visibility.occluded8(start, d.x, d.y, d.z, lanes, see);
    rays += std::popcount(lanes);
    open_lanes_[p] = static_cast<std::uint8_t>(lanes & ~blocked);
    blocked_lanes_[p] = static_cast<std::uint8_t>(blocked);
    open_ |= std::uint64_t{open_lanes_[p] != 0} << p;
    blocked_ |= std::uint64_t{blocked != 0} << p;
  }
}

void SkyView::diffuse(const Bsdf& b, float* values) {
  if (!(b.coat_f0 > 0)) {
    weigh(packets_, open_, open_lanes_.data(), cosine_.data(), nullptr, to_float(1 / kPi), values);
    return;
  }
  // Nothing gets below a coat that reflects all (see Bsdf::diffuse_in).
  const float scale = b.coat_pass > 1e-9 ? to_float(1 / (kPi * b.coat_pass)) : 0;
  alignas(32) float pass[8 * kMost];
  if (coats_.size() > kMostCoats) coats_.clear();
  const std::int32_t coat = coats_.add(b);
  for (std::uint64_t left = open_; left != 0; left &= left - 1) {
    const auto at = 8 * static_cast<std::size_t>(std::countr_zero(left));
    coats_.passing(coat, cosine_.data() + at, 8, pass + at);
  }
  weigh(packets_, open_, open_lanes_.data(), cosine_.data(), pass, scale, values);
}

void SkyView::lobe(const Bsdf& b, float* first, float* second) {
  alignas(32) float unused[8];
  for (std::uint64_t left = open_; left != 0; left &= left - 1) {
    const auto p = static_cast<std::size_t>(std::countr_zero(left));
    const Packet& d = packets_[p];
    lobe_values(b, 8, d.x, d.y, d.z, first + 8 * p, second ? second + 8 * p : unused);
  }
  weigh_lobe(packets_, open_, open_lanes_.data(), first);
  if (second) weigh_lobe(packets_, open_, open_lanes_.data(), second);
}

}  // namespace haarlight
