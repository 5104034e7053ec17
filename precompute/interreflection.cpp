// Light that reaches a tile's receivers by way of other surfaces.

#include "precompute/interreflection.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "precompute/random.h"
#include "precompute/row_products.h"
#include "precompute/specular_path.h"
#include "prt/prior_lighting.h"
#include "prt/transport.h"

namespace haarlight {
namespace {

constexpr std::size_t kRows = kTileRows;
constexpr std::size_t kOut = 3 * kRows;  // channel * kRows + row
constexpr int kSubBatches = 4;           // of a batch; their spread is the noise
constexpr int kFollowOneIn = 4;          // of a vertex' directions that mirrors or glass block
constexpr std::int32_t kShared = -1;
constexpr double kWideLobe = 0.3;    // half width, radians
constexpr double kNearlySame = 0.1;  // directions for which a wide lobe is one, radians

enum Part : unsigned { kDiffuse = 1, kLobe = 2, kDelta = 4, kAllParts = 7 };

// 1 where the coat, if any, lets all through: diffuse_in is (n.w) / pi times this.
double coat_in(const Bsdf& b, const Vec3& w) {
  if (!(b.coat_f0 > 0)) return 1;
  const double cosine = dot(b.normal, w);
  return cosine > 0 ? b.diffuse_in(w) * kPi / cosine : 0;
}

Vec3 vec(float x, float y, float z) {
  return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

RgbD lobe_color(const Bsdf& b, const Vec3& w) {
  const Bsdf::LobeValues v = b.lobe_values(w);
  return v.first * b.gloss_first + v.second * b.gloss_second;
}

// A receiver's lobe wide enough to be served by the paths of all.
bool shares_lobe(const Bsdf& b) { return b.has_lobe() && b.lobe_half_width() >= kWideLobe; }

// What a receiver sends to the viewer of light from `w`, by diffuse reflection and a wide lobe,
// over (n.w) / pi: the weight of a direction drawn by the cosine.
RgbD over_cosine(const Bsdf& b, const Vec3& w) {
  RgbD f = b.diffuse_out(b.to_viewer) * coat_in(b, w);
  if (!shares_lobe(b)) return f;
  const double cosine = dot(b.normal, w);
  if (cosine > 0) f += lobe_color(b, w) * (kPi / cosine);
  return f;
}

double delta_luminance(const Bsdf& b) {
  double sum = 0;
  for (int i = 0; i < b.delta_count; ++i) {
    sum += luminance(b.delta[static_cast<std::size_t>(i)].weight);
  }
  return sum;
}

void apply_effects(const Effects& effects, Bsdf& b) {
  if (!effects.gloss) b.lobe = Bsdf::Lobe::none;
  if (!effects.caustics) b.delta_count = 0;
}

// Chooses an index with chances in proportion to weights.
class Chances {
 public:
  void clear() { sum_.clear(); }
  void add(double weight) { sum_.push_back((sum_.empty() ? 0 : sum_.back()) + weight); }
  double total() const { return sum_.empty() ? 0 : sum_.back(); }
  double of(std::size_t i) const { return (sum_[i] - (i > 0 ? sum_[i - 1] : 0)) / total(); }
  std::size_t choose(double u) const {
    const auto at = std::upper_bound(sum_.begin(), sum_.end(), u * total());
    return std::min(static_cast<std::size_t>(at - sum_.begin()), sum_.size() - 1);
  }

 private:
  std::vector<double> sum_;
};

// Receivers as packets of eight, for connections.
struct alignas(32) ReceiverPacket {
  float x[8], y[8], z[8];  // origin, just off the surface
};

}  // namespace

void TileNoise::add(const TileNoise& other) {
  variance.resize(std::max(variance.size(), other.variance.size()), 0.0);
  energy.resize(variance.size(), 0.0);
  for (std::size_t l = 0; l < other.variance.size(); ++l) {
    variance[l] += other.variance[l];
    energy[l] += other.energy[l];
  }
  paths += other.paths;
}

double TileNoise::worst() const {
  double most = 0;
  for (std::size_t l = 0; l < variance.size(); ++l) {
    if (energy[l] > 0) most = std::max(most, variance[l] / energy[l]);
  }
  return std::sqrt(most);
}

// Memory of one thread.
struct Interreflection::Scratch {
  // A column: what one vertex sees of one phase of the sky, and how it counts.
  struct Column {
    std::int32_t path = 0, phase = 0;
    RgbD tint;
  };
  // Light that left in a single direction.
  struct Deposit {
    std::int32_t path = 0;
    std::size_t texel = 0;
    RgbD tint;
  };
  struct Path {
    std::int32_t row = kShared;
    RgbD own;              // weight of the row if not shared
    std::size_t base = 0;  // weights of all rows if shared: into bases
    int sub_batch = 0;
    std::vector<RgbD> light;  // per built-in lighting: what the path brings
  };
  std::vector<Column> columns;
  std::vector<float> values;  // [column][slot]
  std::vector<Deposit> deposits;
  std::vector<Path> paths;
  std::vector<float> bases;      // [shared path][kOut]
  std::vector<float> sums;       // [phase][kOut][slot]
  std::vector<float> deposited;  // [kOut][texel]; empty until there is any
  std::vector<float> weights;
  std::vector<const float*> pointers;
  std::vector<ReceiverPacket> packets;
  std::vector<unsigned char> visible;  // lane masks of the vertex looked from
  Chances diffuse, lobe;
  std::vector<double> sub_sum, sum, square;  // [light][kOut]
};

std::unique_ptr<Interreflection::Scratch, void (*)(Interreflection::Scratch*)>
Interreflection::make_scratch() {
  return {new Scratch, [](Scratch* s) { delete s; }};
}

// One tile's work.
class Interreflection::Batch {
 public:
  Batch(const Interreflection& owner, const TileReceivers& tile, Scratch& scratch,
        RayCounts& counts)
      : o_(owner), tile_(tile), s_(scratch), counts_(counts) {
    s_.diffuse.clear(), s_.lobe.clear();
    s_.packets.assign((tile.receivers.size() + 7) / 8, ReceiverPacket{});
    for (std::size_t i = 0; i < tile.receivers.size(); ++i) {
      const Receiver& r = tile.receivers[i];
      const bool wide = shares_lobe(r.bsdf);
      const RgbD lobe = r.bsdf.has_lobe() ? r.bsdf.lobe_albedo() : RgbD{};
      s_.diffuse.add(luminance(r.weight * (r.bsdf.diffuse_albedo() + (wide ? lobe : RgbD{}))));
      s_.lobe.add(wide ? 0 : luminance(r.weight * lobe));
      const Vec3 at = origin(r);
      ReceiverPacket& p = s_.packets[i / 8];
      p.x[i % 8] = static_cast<float>(at.x), p.y[i % 8] = static_cast<float>(at.y);
      p.z[i % 8] = static_cast<float>(at.z);
    }
    for (int d = 0; d < 4; ++d) {
      shift_[d] = unit_number(mix_bits(o_.seed_, static_cast<std::uint64_t>(d)));
      lobe_shift_[d] = unit_number(mix_bits(o_.seed_, static_cast<std::uint64_t>(d + 4)));
    }
  }

  bool has_diffuse() const { return s_.diffuse.total() > 0; }
  bool has_lobes() const { return s_.lobe.total() > 0; }

  // Paths [first, first + kPathBatch) of each kind, into columns and deposits.
  void trace(int first) {
    s_.columns.clear(), s_.values.clear(), s_.deposits.clear(), s_.paths.clear();
    s_.bases.clear();
    for (int i = 0; i < kPathBatch; ++i) {
      sub_batch_ = i * kSubBatches / kPathBatch;
      if (has_diffuse()) start_diffuse(static_cast<std::uint64_t>(first + i));
      if (has_lobes()) start_lobe(static_cast<std::uint64_t>(first + i));
    }
  }

  void apply() {
    const std::size_t slots = o_.directions_.slots();
    // Shared columns, a product a phase.
    for (std::size_t phase = 0; phase < o_.phases(); ++phase) {
      s_.pointers.clear();
      s_.weights.clear();
      for (std::size_t k = 0; k < s_.columns.size(); ++k) {
        const Scratch::Column& column = s_.columns[k];
        const Scratch::Path& path = s_.paths[static_cast<std::size_t>(column.path)];
        if (static_cast<std::size_t>(column.phase) != phase || path.row != kShared) continue;
        s_.pointers.push_back(s_.values.data() + k * slots);
        const float* base = s_.bases.data() + path.base;
        const float tint[3] = {static_cast<float>(column.tint.r), static_cast<float>(column.tint.g),
                               static_cast<float>(column.tint.b)};
        for (std::size_t m = 0; m < kOut; ++m) s_.weights.push_back(base[m] * tint[m / kRows]);
      }
      add_row_products(s_.weights.data(), s_.pointers, kOut, slots,
                       s_.sums.data() + phase * kOut * slots);
    }
    for (std::size_t k = 0; k < s_.columns.size(); ++k) {
      const Scratch::Column& column = s_.columns[k];
      const Scratch::Path& path = s_.paths[static_cast<std::size_t>(column.path)];
      if (path.row == kShared) continue;
      const RgbD weight = path.own * column.tint;
      const float* values = s_.values.data() + k * slots;
      for (std::size_t c = 0; c < 3; ++c) {
        const auto w = static_cast<float>(c == 0 ? weight.r : c == 1 ? weight.g : weight.b);
        float* sum = s_.sums.data() + (static_cast<std::size_t>(column.phase) * kOut + c * kRows +
                                       static_cast<std::size_t>(path.row)) *
                                          slots;
        for (std::size_t j = 0; j < slots; ++j) sum[j] += w * values[j];
      }
    }
    if (s_.deposits.empty()) return;
    const auto texels = static_cast<std::size_t>(o_.layout_.size());
    if (s_.deposited.empty()) s_.deposited.assign(kOut * texels, 0.0f);
    for (const Scratch::Deposit& d : s_.deposits) {
      const Scratch::Path& path = s_.paths[static_cast<std::size_t>(d.path)];
      float* sum = s_.deposited.data() + d.texel;
      const double tint[3] = {d.tint.r, d.tint.g, d.tint.b};
      if (path.row != kShared) {
        const double own[3] = {path.own.r, path.own.g, path.own.b};
        for (std::size_t c = 0; c < 3; ++c) {
          sum[(c * kRows + static_cast<std::size_t>(path.row)) * texels] +=
              static_cast<float>(own[c] * tint[c]);
        }
        continue;
      }
      const float* base = s_.bases.data() + path.base;
      for (std::size_t m = 0; m < kOut; ++m) {
        sum[m * texels] += base[m] * static_cast<float>(tint[m / kRows]);
      }
    }
  }

  // Adds the pictures that each quarter of the batch gives under the built-in lightings to the sums
  // from which noise is judged.
  void judge() {
    for (int b = 0; b < kSubBatches; ++b) {
      std::fill(s_.sub_sum.begin(), s_.sub_sum.end(), 0.0);
      for (const Scratch::Path& path : s_.paths) {
        if (path.sub_batch != b) continue;
        for (std::size_t l = 0; l < o_.lights_; ++l) {
          const double light[3] = {path.light[l].r, path.light[l].g, path.light[l].b};
          double* sum = s_.sub_sum.data() + l * kOut;
          if (path.row == kShared) {
            const float* base = s_.bases.data() + path.base;
            for (std::size_t m = 0; m < kOut; ++m) {
              sum[m] += static_cast<double>(base[m]) * light[m / kRows];
            }
          } else {
            const double own[3] = {path.own.r, path.own.g, path.own.b};
            for (std::size_t c = 0; c < 3; ++c) {
              sum[c * kRows + static_cast<std::size_t>(path.row)] += own[c] * light[c];
            }
          }
        }
      }
      for (std::size_t m = 0; m < s_.sum.size(); ++m) {
        const double mean = s_.sub_sum[m] * kSubBatches / kPathBatch;
        s_.sum[m] += mean;
        s_.square[m] += mean * mean;
      }
    }
  }

 private:
  Vec3 origin(const Receiver& r) const {
    return r.position + Visibility::kSurfaceOffset * r.bsdf.geometric_normal;
  }

  std::int32_t new_path(std::int32_t row, const RgbD& own) {
    Scratch::Path path;
    path.row = row;
    path.own = own;
    path.sub_batch = sub_batch_;
    path.light.assign(o_.lights_, RgbD{});
    s_.paths.push_back(std::move(path));
    ++counts_.paths;
    return static_cast<std::int32_t>(s_.paths.size()) - 1;
  }

  void start_diffuse(std::uint64_t i) {
    const EvenPoint u = even_point(i, shift_);
    const std::size_t l = s_.diffuse.choose(u.value[0]);
    const Receiver& r = tile_.receivers[l];
    const Vec3 w = cosine_direction(r.bsdf.normal, u.value[2], u.value[3]);
    if (!(dot(w, r.bsdf.geometric_normal) > 0)) return;
    PathRandom random(mix_bits(o_.seed_ + 1, i));
    phase_ = static_cast<int>(u.value[1] * static_cast<double>(o_.phases()));
    ++counts_.bounce;
    const auto hit = surface_hit(o_.scene_, o_.visibility_, origin(r), w);
    if (!hit) return;
    Bsdf b = bsdf_at(o_.scene_, *hit);
    const bool specular = b.is_specular();
    apply_effects(o_.effects_, b);
    // f cos / (q p) of this receiver alone.
    const RgbD alone = r.weight * over_cosine(r.bsdf, w) * (1 / s_.diffuse.of(l));
    const auto row = static_cast<std::int32_t>(r.row);
    if (specular) {
      if (b.delta_count == 0) return;
      const PathEnd end = follow_specular(o_.scene_, o_.visibility_, *hit, b, AtMixed::choose,
                                          random, counts_.bounce);
      if (!end.hit || !(luminance(end.weight) > 0)) return;
      Bsdf at_end = end.bsdf;
      apply_effects(o_.effects_, at_end);
      walk(new_path(row, alone * end.weight), *end.hit, at_end, kAllParts, {1, 1, 1}, 1, false,
           random);
      return;
    }
    if (b.has_diffuse() || shares_lobe(b)) look_back(*hit, b, l);
    if (b.has_diffuse()) {
      const std::size_t base = connect(b);
      const std::int32_t path = new_path(kShared, {});
      s_.paths.back().base = base;
      walk(path, *hit, b, kDiffuse, {1, 1, 1}, 1, false, random);
    }
    unsigned rest = kLobe | kDelta;
    if (shares_lobe(b)) {
      if (const auto base = connect_lobe(l)) {
        const std::int32_t path = new_path(kShared, {});
        s_.paths.back().base = *base;
        walk(path, *hit, b, kLobe, {1, 1, 1}, 1, false, random);
        rest = kDelta;
      }
    }
    if ((b.has_lobe() && (rest & kLobe) != 0) || b.delta_count > 0) {
      walk(new_path(row, alone), *hit, b, rest, {1, 1, 1}, 1, false, random);
    }
  }

  void start_lobe(std::uint64_t i) {
    const EvenPoint u = even_point(i, lobe_shift_);
    const std::size_t l = s_.lobe.choose(u.value[0]);
    const Receiver& r = tile_.receivers[l];
    const auto sample = r.bsdf.sample_lobe(u.value[2], u.value[3]);
    if (!sample || !(dot(sample->direction, r.bsdf.geometric_normal) > 0)) return;
    PathRandom random(mix_bits(o_.seed_ + 2, i));
    phase_ = static_cast<int>(u.value[1] * static_cast<double>(o_.phases()));
    ++counts_.bounce;
    const auto hit = surface_hit(o_.scene_, o_.visibility_, origin(r), sample->direction);
    if (!hit) return;
    RgbD weight =
        r.weight * lobe_color(r.bsdf, sample->direction) * (1 / (sample->pdf * s_.lobe.of(l)));
    Bsdf b = bsdf_at(o_.scene_, *hit);
    const bool specular = b.is_specular();
    apply_effects(o_.effects_, b);
    SurfaceHit at = *hit;
    if (specular) {
      if (b.delta_count == 0) return;
      const PathEnd end = follow_specular(o_.scene_, o_.visibility_, *hit, b, AtMixed::choose,
                                          random, counts_.bounce);
      if (!end.hit || !(luminance(end.weight) > 0)) return;
      weight = weight * end.weight;
      at = *end.hit;
      b = end.bsdf;
      apply_effects(o_.effects_, b);
    }
    walk(new_path(static_cast<std::int32_t>(r.row), weight), at, b, kAllParts, {1, 1, 1}, 1, false,
         random);
  }

  // Weights of all rows for what y sends by diffuse reflection; y was found by receiver `finder`.
  // Returns where they are in bases.
  std::size_t connect(const Bsdf& b) {
    const std::size_t at = s_.bases.size();
    s_.bases.resize(at + kOut, 0.0f);
    if (!(density_ > 0)) return at;  // grazing to rounding
    for (std::size_t l = 0; l < tile_.receivers.size(); ++l) {
      if (!(seen_[l].geometry > 0)) continue;
      add_weight(at, l, b.diffuse_out(seen_[l].towards) * (seen_[l].geometry / kPi / density_));
    }
    return at;
  }

  // The same for what y sends by a wide lobe, to receivers that y sees within kNearlySame of the
  // finder: they get what it would get. Whoever is that near to a receiver may serve it, so the
  // density is summed over those.
  std::optional<std::size_t> connect_lobe(std::size_t finder) {
    if (!(seen_[finder].geometry > 0)) return std::nullopt;
    const double least = std::cos(kNearlySame);
    const std::size_t count = tile_.receivers.size(), at = s_.bases.size();
    s_.bases.resize(at + kOut, 0.0f);
    // Where all are within half the angle of the finder, all are near each other.
    const double half = std::cos(0.5 * kNearlySame);
    const bool all = std::all_of(seen_.begin(), seen_.end(), [&](const Seen& s) {
      return !(s.geometry > 0) || dot(s.towards, seen_[finder].towards) >= half;
    });
    for (std::size_t l = 0; l < count; ++l) {
      const Seen& here = seen_[l];
      if (!(here.geometry > 0) || dot(here.towards, seen_[finder].towards) < least) continue;
      double density = all ? density_ : 0;
      for (std::size_t f = 0; f < (all ? 0 : count); ++f) {
        if (seen_[f].geometry > 0 && dot(here.towards, seen_[f].towards) >= least) {
          density += s_.diffuse.of(f) * seen_[f].geometry / kPi;
        }
      }
      const double share = here.geometry / kPi / density;
      add_weight(at, l, {share, share, share});
    }
    return at;
  }

  // Adds what receiver l sends on of `value` from where seen_[l] says to its row's weight.
  void add_weight(std::size_t base, std::size_t l, const RgbD& value) {
    const RgbD weight = seen_[l].onwards * value;
    float* to = s_.bases.data() + base + tile_.receivers[l].row;
    to[0] += static_cast<float>(weight.r);
    to[kRows] += static_cast<float>(weight.g);
    to[2 * kRows] += static_cast<float>(weight.b);
  }

  // Fills seen_ with the receivers that y sees, and density_ with the density per area with which
  // they find y.
  void look_back(const SurfaceHit& y, const Bsdf& b, std::size_t finder) {
    const Vec3 from = y.position + Visibility::kSurfaceOffset * y.geometric_normal;
    const std::array<float, 3> start{static_cast<float>(from.x), static_cast<float>(from.y),
                                     static_cast<float>(from.z)};
    const std::size_t count = tile_.receivers.size();
    seen_.assign(count, {});
    double density = 0;  // with which the tile's receivers find y, per area
    for (std::size_t p = 0; p < s_.packets.size(); ++p) {
      alignas(32) float x[8], yy[8], z[8];
      unsigned lanes = 0;
      for (std::size_t i = 0; i < 8; ++i) {
        x[i] = s_.packets[p].x[i] - start[0];
        yy[i] = s_.packets[p].y[i] - start[1];
        z[i] = s_.packets[p].z[i] - start[2];
        const std::size_t l = 8 * p + i;
        if (l >= count) continue;
        const Receiver& r = tile_.receivers[l];
        const Vec3 d = vec(x[i], yy[i], z[i]);
        const double square = dot(d, d);
        if (!(square > 0)) continue;
        const Vec3 o = d * (1 / std::sqrt(square));  // from y to x
        const double at_y = dot(o, b.geometric_normal);
        const double at_x = -dot(o, r.bsdf.normal);
        if (!(at_y > 0) || !(at_x > 0) || !(dot(o, r.bsdf.geometric_normal) < 0)) continue;
        seen_[l] = {o, at_x * at_y / square, {}};
        lanes |= 1u << i;
      }
      if (lanes == 0) continue;
      unsigned blocked = o_.visibility_.occluded8_segments(start, x, yy, z, lanes);
      counts_.connection += std::popcount(lanes);
      if (finder / 8 == p) blocked &= ~(1u << (finder % 8));
      for (std::size_t i = 0; i < 8; ++i) {
        if (!((lanes & ~blocked) >> i & 1u)) {
          if (8 * p + i < count) seen_[8 * p + i].geometry = 0;
          continue;
        }
        Seen& here = seen_[8 * p + i];
        const Receiver& r = tile_.receivers[8 * p + i];
        here.onwards = r.weight * over_cosine(r.bsdf, -here.towards);
        density += s_.diffuse.of(8 * p + i) * here.geometry / kPi;
      }
    }
    density_ = density;
  }

  // From vertex y, number `bounce` of the path, along the path. `parts` of y's BSDF count. Shared
  // paths have y's diffuse colour in their base weights already. Light that comes straight to y by
  // its single directions counts only where `alone`: otherwise whoever looked this way has followed
  // them already.
  void walk(std::int32_t path, SurfaceHit y, Bsdf b, unsigned parts, RgbD tint, int bounce,
            bool alone, PathRandom& random) {
    bool in_base = s_.paths[static_cast<std::size_t>(path)].row == kShared;
    for (;;) {
      const bool narrow = b.has_lobe() && b.lobe_half_width() < o_.narrow_;
      const RgbD out = in_base ? RgbD{1, 1, 1} : b.diffuse_out(b.to_viewer);
      const bool diffuse = (parts & kDiffuse) != 0 && b.has_diffuse();
      const bool lobe = (parts & kLobe) != 0 && b.has_lobe();
      if (diffuse || (lobe && !narrow))
        gather(path, y, b, diffuse, lobe && !narrow, out, tint, random);

      // One way on.
      const bool more = bounce < o_.effects_.bounces;
      const double by_diffuse =
          diffuse && more ? luminance(tint * (in_base ? b.diffuse_reflectance : b.diffuse_albedo()))
                          : 0;
      const double by_lobe = lobe && (more || narrow) ? luminance(tint * b.lobe_albedo()) : 0;
      const double by_delta = (parts & kDelta) != 0 ? luminance(tint) * delta_luminance(b) : 0;
      const double total = by_diffuse + by_lobe + by_delta;
      if (!(total > 0)) return;
      const double survive = std::min(1.0, total);
      if (survive < 1 && random.next() >= survive) return;
      double pick = random.next() * total;
      Vec3 w;
      bool sampled_alone = alone;
      if (pick < by_diffuse) {
        const double u = random.next(), v = random.next();
        w = cosine_direction(b.normal, u, v);
        tint = tint * out * (coat_in(b, w) * total / (by_diffuse * survive));
        sampled_alone = false;
      } else if ((pick -= by_diffuse) < by_lobe) {
        const double u = random.next(), v = random.next();
        const auto sample = b.sample_lobe(u, v);
        if (!sample) return;
        w = sample->direction;
        tint = tint * lobe_color(b, w) * (total / (sample->pdf * by_lobe * survive));
        sampled_alone = narrow;
      } else {
        const PathEnd end = follow_specular(o_.scene_, o_.visibility_, y, b, AtMixed::choose,
                                            random, counts_.bounce);
        tint = tint * end.weight * (total / (by_delta * survive));
        if (!(luminance(tint) > 0)) return;
        if (!end.hit) {
          if (alone) deposit(path, end.direction, tint);
          return;
        }
        y = *end.hit;
        b = end.bsdf;
        apply_effects(o_.effects_, b);
        parts = kAllParts;
        in_base = false;
        continue;  // the same bounce: nothing was scattered
      }
      in_base = false;
      if (!(dot(w, b.geometric_normal) > 0) || !(luminance(tint) > 0)) return;
      ++counts_.bounce;
      const auto next = surface_hit(o_.scene_, o_.visibility_, leave_surface(y, w), w);
      if (!next) {
        if (sampled_alone) deposit(path, w, tint);
        return;
      }
      y = *next;
      b = bsdf_at(o_.scene_, y);
      const bool specular = b.is_specular();
      apply_effects(o_.effects_, b);
      alone = sampled_alone;
      parts = kAllParts;
      if (specular) {
        if (b.delta_count == 0) return;
        const PathEnd end = follow_specular(o_.scene_, o_.visibility_, y, b, AtMixed::choose,
                                            random, counts_.bounce);
        tint = tint * end.weight;
        if (!(luminance(tint) > 0)) return;
        if (!end.hit) {
          if (sampled_alone) deposit(path, end.direction, tint);
          return;
        }
        y = *end.hit;
        b = end.bsdf;
        apply_effects(o_.effects_, b);
      }
      if (!more) return;
      ++bounce;
    }
  }

  void deposit(std::int32_t path, const Vec3& direction, const RgbD& tint) {
    const std::size_t texel = texel_of(direction, o_.layout_.face_size());
    s_.deposits.push_back({path, texel, tint});
    Scratch::Path& p = s_.paths[static_cast<std::size_t>(path)];
    for (std::size_t l = 0; l < o_.lights_; ++l) {
      p.light[l] +=
          tint * static_cast<double>(
                     o_.light_texels_[l * static_cast<std::size_t>(o_.layout_.size()) + texel]);
    }
  }

  // What y sees of a phase of the sky, as one column a part.
  void gather(std::int32_t path, const SurfaceHit& y, const Bsdf& b, bool diffuse, bool lobe,
              const RgbD& out, const RgbD& tint, PathRandom& random) {
    const std::size_t slots = o_.directions_.slots();
    const int phase =
        phase_ >= 0 ? phase_ : static_cast<int>(random.next() * static_cast<double>(o_.phases()));
    phase_ = -1;
    const int place = static_cast<int>(random.next() * o_.directions_.places());
    const std::uint64_t key = mix_bits(
        o_.seed_ + 3, static_cast<std::uint64_t>(path) * 64 + static_cast<std::uint64_t>(place));
    const SparseDirections::Packet* packets = o_.directions_.packets(phase, place);
    const Vec3 from = y.position + Visibility::kSurfaceOffset * y.geometric_normal;
    const std::array<float, 3> start{static_cast<float>(from.x), static_cast<float>(from.y),
                                     static_cast<float>(from.z)};
    const auto nx = static_cast<float>(b.normal.x), ny = static_cast<float>(b.normal.y),
               nz = static_cast<float>(b.normal.z);
    const auto gx = static_cast<float>(b.geometric_normal.x),
               gy = static_cast<float>(b.geometric_normal.y),
               gz = static_cast<float>(b.geometric_normal.z);
    const bool follow = o_.effects_.caustics && o_.visibility_.has_specular();
    const bool coat = b.coat_f0 > 0;
    const auto inverse_pi = static_cast<float>(1 / kPi);

    // Columns: diffuse, first and second of the lobe, as wanted.
    const std::size_t first_column = s_.columns.size();
    if (diffuse) s_.columns.push_back({path, phase, tint * out});
    if (lobe) {
      s_.columns.push_back({path, phase, tint * b.gloss_first});
      if (l1_norm(b.gloss_second) > 0) {
        s_.columns.push_back({path, phase, tint * b.gloss_second});
      }
    }
    const std::size_t columns = s_.columns.size() - first_column;
    s_.values.resize(s_.values.size() + columns * slots, 0.0f);
    float* const values = s_.values.data() + first_column * slots;
    float* const of_lobe = values + (diffuse ? slots : 0);
    const bool second = columns == (diffuse ? 3u : 2u);

    for (std::size_t p = 0; p < slots / 8; ++p) {
      const SparseDirections::Packet& d = packets[p];
      float cosine[8];
      unsigned lanes = 0;
      for (unsigned i = 0; i < 8; ++i) cosine[i] = nx * d.x[i] + ny * d.y[i] + nz * d.z[i];
      for (unsigned i = 0; i < 8; ++i) {
        const float g = gx * d.x[i] + gy * d.y[i] + gz * d.z[i];
        lanes |= static_cast<unsigned>(cosine[i] > 0 && g > 0 && d.weight[i] > 0) << i;
      }
      if (lanes == 0) continue;
      const unsigned blocked = o_.visibility_.occluded8(start, d.x, d.y, d.z, lanes);
      counts_.shadow += std::popcount(lanes);
      const unsigned lit = lanes & ~blocked;
      if (diffuse) {
        for (unsigned i = 0; i < 8; ++i) {
          values[8 * p + i] = lit >> i & 1u ? cosine[i] * d.weight[i] * inverse_pi : 0.0f;
        }
        if (coat) {
          for (unsigned bits = lit; bits != 0; bits &= bits - 1) {
            const auto i = static_cast<unsigned>(std::countr_zero(bits));
            values[8 * p + i] *= static_cast<float>(coat_in(b, vec(d.x[i], d.y[i], d.z[i])));
          }
        }
      }
      if (lobe) {
        for (unsigned bits = lit; bits != 0; bits &= bits - 1) {
          const auto i = static_cast<unsigned>(std::countr_zero(bits));
          const Bsdf::LobeValues v = b.lobe_values(vec(d.x[i], d.y[i], d.z[i]));
          of_lobe[8 * p + i] = static_cast<float>(v.first) * d.weight[i];
          if (second) of_lobe[slots + 8 * p + i] = static_cast<float>(v.second) * d.weight[i];
        }
      }
      if (!follow || blocked == 0) continue;
      for (unsigned bits = blocked; bits != 0; bits &= bits - 1) {
        const auto i = static_cast<unsigned>(std::countr_zero(bits));
        PathRandom chance(mix_bits(key, 8 * p + i));
        if (chance.next() * kFollowOneIn >= 1) continue;
        const Vec3 w = vec(d.x[i], d.y[i], d.z[i]);
        ++counts_.specular;
        const auto hit = surface_hit(o_.scene_, o_.visibility_, from, w);
        if (!hit) continue;
        const Bsdf met = bsdf_at(o_.scene_, *hit);
        if (met.delta_count == 0) continue;
        const PathEnd end = follow_specular(o_.scene_, o_.visibility_, *hit, met, AtMixed::pass,
                                            chance, counts_.specular);
        if (end.hit || !(luminance(end.weight) > 0)) continue;
        RgbD through;
        if (diffuse) through += out * b.diffuse_in(w);
        if (lobe) through += lobe_color(b, w);
        deposit(path, end.direction,
                tint * through * end.weight * (static_cast<double>(d.weight[i]) * kFollowOneIn));
      }
    }

    // What it brings under the built-in lightings.
    Scratch::Path& of = s_.paths[static_cast<std::size_t>(path)];
    for (std::size_t c = 0; c < columns; ++c) {
      for (std::size_t l = 0; l < o_.lights_; ++l) {
        const float* light =
            o_.light_.data() + (static_cast<std::size_t>(phase) * o_.lights_ + l) * slots;
        const auto sum = static_cast<double>(dot_product(light, values + c * slots, slots));
        of.light[l] += s_.columns[first_column + c].tint * sum;
      }
    }
  }

  struct Seen {
    Vec3 towards;         // from y to the receiver, unit
    double geometry = 0;  // both cosines by the squared distance; 0: not seen
    RgbD onwards;         // what the receiver's row shows of light from y, over (n.w) / pi
  };

  const Interreflection& o_;
  const TileReceivers& tile_;
  Scratch& s_;
  RayCounts& counts_;
  std::vector<Seen> seen_;
  double density_ = 0;
  double shift_[4], lobe_shift_[4];
  int sub_batch_ = 0;
  int phase_ = -1;  // of the path's first vertex, evenly spread over paths; -1: random
};

Interreflection::Interreflection(const Scene& scene, const Visibility& visibility,
                                 const DirectionTable& table, const Effects& effects,
                                 int resolution, std::uint64_t seed)
    : scene_(scene),
      visibility_(visibility),
      effects_(effects),
      seed_(seed),
      layout_(table.n),
      directions_(table, resolution),
      narrow_(4.0 / resolution) {
  const std::size_t slots = directions_.slots();
  const auto texels = static_cast<std::size_t>(layout_.size());
  const auto& lightings = prior_lightings(layout_);
  lights_ = lightings.size();
  light_.assign(phases() * lights_ * slots, 0.0f);
  light_texels_.resize(lights_ * texels);
  for (std::size_t l = 0; l < lights_; ++l) {
    const std::span<float> of = std::span(light_texels_).subspan(l * texels, texels);
    haar_inverse(layout_, lightings[l], of);
    for (std::size_t k = 0; k < texels; ++k) {
      const auto at = static_cast<std::size_t>(directions_.square()[k]);
      light_[(at / slots * lights_ + l) * slots + at % slots] += of[k] * directions_.share()[k];
    }
  }
  for (std::size_t k = 0; k < texels; ++k) {
    const auto at = static_cast<std::size_t>(directions_.square()[k]);
    sum_at_.push_back(static_cast<std::uint32_t>(at / slots * kOut * slots + at % slots));
  }
}

Interreflection::~Interreflection() = default;

void Interreflection::add(const TileReceivers& tile, const PathBudget& budget, Scratch& s,
                          std::span<float> rows, TileNoise& noise, RayCounts& counts) const {
  const std::size_t slots = directions_.slots();
  const auto texels = static_cast<std::size_t>(layout_.size());
  Batch batch(*this, tile, s, counts);
  if (effects_.bounces < 1 || (!batch.has_diffuse() && !batch.has_lobes())) return;

  // The direct picture under the built-in lightings, which noise is small or large against.
  std::vector<double> direct(lights_ * kOut, 0.0);
  for (std::size_t m = 0; m < kOut; ++m) {
    for (std::size_t l = 0; l < lights_; ++l) {
      direct[l * kOut + m] = static_cast<double>(
          dot_product(rows.data() + m * texels, light_texels_.data() + l * texels, texels));
    }
  }

  s.sums.assign(phases() * kOut * slots, 0.0f);
  s.deposited.clear();
  s.sub_sum.assign(lights_ * kOut, 0.0);
  s.sum.assign(lights_ * kOut, 0.0);
  s.square.assign(lights_ * kOut, 0.0);
  TileNoise own;
  int done = 0;
  do {
    batch.trace(done);
    batch.apply();
    batch.judge();
    done += kPathBatch;
    const double parts = static_cast<double>(done) * kSubBatches / kPathBatch;
    own.variance.assign(lights_, 0.0);
    own.energy.assign(lights_, 0.0);
    for (std::size_t l = 0; l < lights_; ++l) {
      for (std::size_t m = 0; m < kOut; ++m) {
        const double mean = s.sum[l * kOut + m] / parts;
        const double spread = s.square[l * kOut + m] / parts - mean * mean;
        own.variance[l] += std::max(0.0, spread) / (parts - 1);
        const double value = direct[l * kOut + m] + mean;
        own.energy[l] += value * value;
      }
    }
  } while (own.worst() > budget.noise && done < budget.most);
  own.paths = done;
  noise.add(own);

  const float share = 1.0f / static_cast<float>(done);
  const float* share_of = directions_.share().data();
  for (std::size_t m = 0; m < kOut; ++m) {
    float* row = rows.data() + m * texels;
    const float* sums = s.sums.data() + m * slots;
    for (std::size_t k = 0; k < texels; ++k) row[k] += share * share_of[k] * sums[sum_at_[k]];
    if (s.deposited.empty()) continue;
    for (std::size_t k = 0; k < texels; ++k) row[k] += share * s.deposited[m * texels + k];
  }
}

}  // namespace haarlight
