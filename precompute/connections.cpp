// The receivers of a tile seen from a place on another surface, and how they would have found it.

#include "precompute/connections.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/simd.h"
#include "precompute/incoming_term.h"
#include "precompute/lanes.h"

namespace haarlight {
namespace {

using namespace lanes;

constexpr double kWideLobe = 0.3;              // half width, radians
constexpr std::size_t kMostPlaceCoats = 1024;  // kept: half a MB

float to_float(double x) { return static_cast<float>(x); }
float channel(const RgbD& c, std::size_t i) { return to_float(i == 0 ? c.r : i == 1 ? c.g : c.b); }

struct View {
  const float *x, *y, *z, *nx, *ny, *nz, *gx, *gy, *gz;
  float *dx, *dy, *dz, *wx, *wy, *wz, *cosine, *geometry;
};

// The way from `from`, normal `normal`, to receivers, and both cosines by its square where both
// look at each other.
HAARLIGHT_MULTIVERSION
void find_geometry(const View& v, const float (&from)[3], const float (&normal)[3],
                   std::size_t count) {
  const Vec8 start = all(from[0], from[1], from[2]);
  const Vec8 up = all(normal[0], normal[1], normal[2]);
  for (std::size_t i = 0; i < count; i += 8) {
    const Vec8 at = load(v.x + i, v.y + i, v.z + i);
    const Vec8 way{at.x - start.x, at.y - start.y, at.z - start.z};
    const Eight square = dot(way, way);
    const Eight inverse = inverse_root(square > 1e-30f ? square : all(1e-30f));
    const Vec8 back{-way.x * inverse, -way.y * inverse, -way.z * inverse};
    const Eight at_place = -dot(back, up);
    const Eight cosine = dot(back, load(v.nx + i, v.ny + i, v.nz + i));
    const Eight above = dot(back, load(v.gx + i, v.gy + i, v.gz + i));
    const EightInts seen = (at_place > 0) & (cosine > 0) & (above > 0) & (square > 1e-30f);
    store(v.dx + i, way.x), store(v.dy + i, way.y), store(v.dz + i, way.z);
    store(v.wx + i, back.x), store(v.wy + i, back.y), store(v.wz + i, back.z);
    store(v.cosine + i, cosine);
    store(v.geometry + i, seen ? cosine * at_place * (inverse * inverse) : all(0));
  }
}

// Chance times geometry of receivers seen within `least` of receiver i.
HAARLIGHT_MULTIVERSION
float density_near(const View& v, const float* chance, std::size_t i, float least,
                   std::size_t count) {
  const Vec8 towards = all(v.wx[i], v.wy[i], v.wz[i]);
  Eight sum{};
  for (std::size_t f = 0; f < count; f += 8) {
    const Eight cosine = dot(towards, load(v.wx + f, v.wy + f, v.wz + f));
    sum += cosine >= least ? load(chance + f) * load(v.geometry + f) : all(0);
  }
  return sum_of(sum);
}

}  // namespace

bool shares_lobe(const Bsdf& b) { return b.has_lobe() && b.lobe_half_width() >= kWideLobe; }

void Connections::begin(const TileReceivers& tile) {
  tile_ = &tile;
  count_ = tile.receivers.size();
  padded_ = (count_ + 7) / 8 * 8;
  Lanes& o = of_;
  for (auto* v : {&o.x,     &o.y,       &o.z,   &o.nx,        &o.ny,         &o.nz,  &o.gx, &o.gy,
                  &o.gz,    &o.chance,  &dx_,   &dy_,         &dz_,          &wx_,   &wy_,  &wz_,
                  &cosine_, &geometry_, &pass_, &lobe_first_, &lobe_second_, &share_}) {
    v->assign(padded_, 0.0f);
  }
  for (std::size_t c = 0; c < 3; ++c) {
    for (auto* v : {&o.diffuse[c], &o.first[c], &o.second[c], &onwards_[c]}) {
      v->assign(padded_, 0.0f);
    }
  }
  coat_.assign(padded_, CoatTables::kNone);
  row_.resize(count_);
  coats_.clear(), lobes_.clear(), chances_.clear(), terms_.clear();
  if (place_coats_.size() > kMostPlaceCoats) place_coats_.clear();
  for (std::size_t i = 0; i < count_; ++i) {
    const Receiver& r = tile.receivers[i];
    const Bsdf& b = r.bsdf;
    const bool wide = shares_lobe(b);
    const RgbD albedo = b.diffuse_albedo() + (wide ? b.lobe_albedo() : RgbD{});
    // Terms may be negative, and small ones are worth few paths.
    const double worth = b.term ? b.term->importance : 1;
    if (b.term) terms_.push_back(i);
    chances_.add(worth * luminance(r.weight * albedo));
    const Vec3 at = r.position + Visibility::kSurfaceOffset * b.geometric_normal;
    o.x[i] = to_float(at.x), o.y[i] = to_float(at.y), o.z[i] = to_float(at.z);
    o.nx[i] = to_float(b.normal.x), o.ny[i] = to_float(b.normal.y);
    o.nz[i] = to_float(b.normal.z);
    o.gx[i] = to_float(b.geometric_normal.x), o.gy[i] = to_float(b.geometric_normal.y);
    o.gz[i] = to_float(b.geometric_normal.z);
    // Light gets below a coat by 1 - C(w) over its mean (see Bsdf::diffuse_in).
    const bool coated = b.coat_f0 > 0;
    const double below = !coated ? 1 : b.coat_pass > 1e-9 ? 1 / b.coat_pass : 0;
    const RgbD diffuse = r.weight * b.diffuse_out(b.to_viewer) * below;
    for (std::size_t c = 0; c < 3; ++c) {
      o.diffuse[c][i] = channel(diffuse, c);
      o.first[c][i] = wide ? channel(r.weight * b.gloss_first, c) : 0;
      o.second[c][i] = wide ? channel(r.weight * b.gloss_second, c) : 0;
    }
    if (b.has_diffuse()) coat_[i] = coats_.add(b);
    lobes_.add(b, wide);
    row_[i] = r.row;
  }
  for (std::size_t i = 0; i < count_ && chances_.total() > 0; ++i) {
    o.chance[i] = to_float(chances_.of(i));
  }
}

void Connections::look(const Visibility& visibility, const SurfaceHit& y, const Bsdf& b,
                       std::size_t finder, RayCounts& counts) {
  const Vec3 from = y.position + Visibility::kSurfaceOffset * y.geometric_normal;
  const float start[3] = {to_float(from.x), to_float(from.y), to_float(from.z)};
  const float normal[3] = {to_float(b.geometric_normal.x), to_float(b.geometric_normal.y),
                           to_float(b.geometric_normal.z)};
  const Lanes& o = of_;
  find_geometry({o.x.data(), o.y.data(), o.z.data(), o.nx.data(), o.ny.data(), o.nz.data(),
                 o.gx.data(), o.gy.data(), o.gz.data(), dx_.data(), dy_.data(), dz_.data(),
                 wx_.data(), wy_.data(), wz_.data(), cosine_.data(), geometry_.data()},
                start, normal, padded_);
  density_ = 0;
  for (std::size_t p = 0; p < padded_; p += 8) {
    unsigned lanes = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      lanes |= static_cast<unsigned>(geometry_[p + i] > 0) << i;
    }
    if (lanes == 0) continue;
    alignas(32) float x[8], yy[8], z[8];
    std::copy_n(&dx_[p], 8, x), std::copy_n(&dy_[p], 8, yy), std::copy_n(&dz_[p], 8, z);
    unsigned blocked =
        visibility.occluded8_segments({start[0], start[1], start[2]}, x, yy, z, lanes);
    counts.connection += std::popcount(lanes);
    if (finder / 8 == p / 8) blocked &= ~(1u << (finder % 8));
    for (unsigned bits = blocked; bits != 0; bits &= bits - 1) {
      geometry_[p + static_cast<std::size_t>(std::countr_zero(bits))] = 0;
    }
    double sum = 0;
    for (std::size_t i = p; i < p + 8; ++i) {
      sum += static_cast<double>(o.chance[i]) * static_cast<double>(geometry_[i]);
    }
    density_ += sum / kPi;
  }
  find_onwards();
}

// What rows show of light from the place, in each channel.
void Connections::find_onwards() {
  const bool coats = coats_.size() > 1, lobes = lobes_.any();
  if (coats) coats_.passing(coat_.data(), cosine_.data(), padded_, pass_.data());
  if (lobes) {
    lobes_.values(0, padded_, wx_.data(), wy_.data(), wz_.data(), lobe_first_.data(),
                  lobe_second_.data());
    for (std::size_t i = 0; i < padded_; ++i) {
      const float over = geometry_[i] > 0 ? static_cast<float>(kPi) / cosine_[i] : 0;
      lobe_first_[i] *= over, lobe_second_[i] *= over;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const float* diffuse = of_.diffuse[c].data();
    float* to = onwards_[c].data();
    for (std::size_t i = 0; i < padded_; ++i) to[i] = coats ? diffuse[i] * pass_[i] : diffuse[i];
    if (!lobes) continue;
    const float *first = of_.first[c].data(), *second = of_.second[c].data();
    for (std::size_t i = 0; i < padded_; ++i) {
      to[i] += first[i] * lobe_first_[i] + second[i] * lobe_second_[i];
    }
  }
  for (const std::size_t i : terms_) {
    if (!(geometry_[i] > 0)) continue;
    const Vec3 w{static_cast<double>(wx_[i]), static_cast<double>(wy_[i]),
                 static_cast<double>(wz_[i])};
    const double f = tile_->receivers[i].bsdf.diffuse_in(w) * kPi;
    const float over = to_float(f) / cosine_[i];
    for (auto& channel_onwards : onwards_) channel_onwards[i] *= over;
  }
}

void Connections::add_diffuse(const Bsdf& b, float* weights) {
  if (!(density_ > 0)) return;  // grazing to rounding
  const auto scale = static_cast<float>(1 / (kPi * density_));
  if (b.coat_f0 > 0) {
    const auto nx = to_float(-b.normal.x), ny = to_float(-b.normal.y), nz = to_float(-b.normal.z);
    for (std::size_t i = 0; i < padded_; ++i) {
      pass_[i] = nx * wx_[i] + ny * wy_[i] + nz * wz_[i];
    }
    place_coats_.passing(place_coats_.add(b), pass_.data(), padded_, pass_.data());
    for (std::size_t i = 0; i < padded_; ++i) share_[i] = scale * geometry_[i] * pass_[i];
  } else {
    for (std::size_t i = 0; i < padded_; ++i) share_[i] = scale * geometry_[i];
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const float color = channel(b.diffuse_reflectance, c);
    const float* onwards = onwards_[c].data();
    float* to = weights + c * kTileRows;
    for (std::size_t i = 0; i < count_; ++i) to[row_[i]] += color * share_[i] * onwards[i];
  }
}

void Connections::add_lobe(std::size_t finder, float* weights) {
  const auto cosine_to = [&](std::size_t a, std::size_t b) {
    return wx_[a] * wx_[b] + wy_[a] * wy_[b] + wz_[a] * wz_[b];
  };
  const auto least = to_float(std::cos(kNearlySame)), half = to_float(std::cos(0.5 * kNearlySame));
  // Where all are within half the angle of the finder, all are near each other.
  bool all = true;
  for (std::size_t i = 0; i < count_ && all; ++i) {
    all = !(geometry_[i] > 0) || cosine_to(i, finder) >= half;
  }
  View view{};
  view.wx = wx_.data(), view.wy = wy_.data(), view.wz = wz_.data();
  view.geometry = geometry_.data();
  for (std::size_t i = 0; i < count_; ++i) {
    if (!(geometry_[i] > 0) || cosine_to(i, finder) < least) continue;
    const float density =
        all ? to_float(density_ * kPi) : density_near(view, of_.chance.data(), i, least, padded_);
    const float share = geometry_[i] / density;
    for (std::size_t c = 0; c < 3; ++c) weights[c * kTileRows + row_[i]] += share * onwards_[c][i];
  }
}

}  // namespace haarlight
