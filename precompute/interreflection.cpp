// Light that reaches a tile's receivers by way of other surfaces.

#include "precompute/interreflection.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "precompute/connections.h"
#include "precompute/path_sums.h"
#include "precompute/random.h"
#include "precompute/sky_view.h"
#include "precompute/specular_path.h"

namespace haarlight {
namespace {

constexpr int kFollowOneIn = 4;  // of a vertex' directions that what is followed blocks

enum Part : unsigned { kDiffuse = 1, kLobe = 2, kDelta = 4, kAllParts = 7 };

// 1 where the coat, if any, lets all through: diffuse_in is (n.w) / pi times this.
double coat_in(const Bsdf& b, const Vec3& w) {
  if (!(b.coat_f0 > 0) && !b.term) return 1;
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

}  // namespace

struct Interreflection::Scratch {
  PathSums sums;
  Connections connections;
  SkyView view;
  Chances lobes;  // of receivers to start a path by their lobe
  int paths = 0;  // of the tile, of each kind
};

std::unique_ptr<Interreflection::Scratch, void (*)(Interreflection::Scratch*)>
Interreflection::make_scratch() {
  return {new Scratch, [](Scratch* s) { delete s; }};
}

// One tile's paths.
class Interreflection::Paths {
 public:
  Paths(const Interreflection& owner, const TileReceivers& tile, Scratch& scratch,
        RayCounts& counts)
      : o_(owner), tile_(tile), s_(scratch), counts_(counts) {
    s_.connections.begin(tile);
    s_.lobes.clear();
    for (const Receiver& r : tile.receivers) {
      const bool own = r.bsdf.has_lobe() && !shares_lobe(r.bsdf);
      s_.lobes.add(own ? luminance(r.weight * r.bsdf.lobe_albedo()) : 0);
    }
    for (int d = 0; d < 4; ++d) {
      shift_[d] = unit_number(mix_bits(o_.seed_, static_cast<std::uint64_t>(d)));
      lobe_shift_[d] = unit_number(mix_bits(o_.seed_, static_cast<std::uint64_t>(d + 4)));
    }
  }

  bool any() const { return has_diffuse() || has_lobes(); }

  // Paths [first, first + kPathBatch) of each kind.
  void trace(int first) {
    if (follows_lobes() && has_diffuse()) {
      for (part_ = 0; part_ < PathSums::kParts; ++part_) {
        for (std::size_t l = 0; l < tile_.receivers.size(); ++l) {
          follow_lobes(l, first / kPathBatch * PathSums::kParts + part_);
        }
      }
    }
    for (int i = 0; i < kPathBatch; ++i) {
      part_ = i * PathSums::kParts / kPathBatch;
      if (has_diffuse()) start_diffuse(static_cast<std::uint64_t>(first + i));
      if (has_lobes()) start_lobe(static_cast<std::uint64_t>(first + i));
    }
  }

 private:
  Vec3 origin(const Receiver& r) const {
    return r.position + Visibility::kSurfaceOffset * r.bsdf.geometric_normal;
  }

  bool has_diffuse() const { return s_.connections.chances().total() > 0; }
  bool has_lobes() const { return s_.lobes.total() > 0; }

  // Whether light by way of narrow lobes is looked for.
  bool follows_lobes() const { return o_.effects_.gloss && o_.visibility_.has_glossy(); }
  bool follows_specular() const { return o_.effects_.caustics && o_.visibility_.has_specular(); }
  // Whether a place is of the surfaces that are looked for.
  bool is_followed(const SurfaceHit& y, const Bsdf& b) const {
    return b.has_lobe() && b.lobe_half_width() < o_.narrow_ &&
           may_have_narrow_lobe(o_.scene_.material[y.material]);
  }

  // One direction of y's narrow lobe, with its share of the lobe, if it leads out of the scene.
  struct Glint {
    Vec3 direction;
    RgbD weight;
  };
  std::optional<Glint> glint(const SurfaceHit& y, const Bsdf& b, PathRandom& random) {
    const double u = random.next(), v = random.next();
    const auto sample = b.sample_lobe(u, v);
    if (!sample || !(dot(sample->direction, b.geometric_normal) > 0)) return std::nullopt;
    const Vec3 from = leave_surface(y, sample->direction);
    const std::array<float, 3> start{static_cast<float>(from.x), static_cast<float>(from.y),
                                     static_cast<float>(from.z)};
    ++counts_.shadow;
    if (o_.visibility_.occluded(start, sample->direction,
                                std::numeric_limits<double>::infinity())) {
      return std::nullopt;
    }
    return Glint{sample->direction, lobe_color(b, sample->direction) * (1 / sample->pdf)};
  }

  // What narrow lobes that receiver l sees by diffuse reflection, or by a wide lobe of its own,
  // send it from the open: paths would find them by chance only, and each with much light. Estimate
  // `number` of as many as there are parts of batches, by one phase of the sky.
  void follow_lobes(std::size_t l, int number) {
    const Receiver& r = tile_.receivers[l];
    if (!(s_.connections.chances().of(l) > 0)) return;
    const SparseDirections& directions = o_.sky_.directions();
    PathRandom random(mix_bits(mix_bits(o_.seed_ + 4, l), static_cast<std::uint64_t>(number)));
    const auto phases = static_cast<std::uint64_t>(o_.sky_.phases());
    const auto phase =
        static_cast<int>((mix_bits(o_.seed_ + 5, l) + static_cast<std::uint64_t>(number)) % phases);
    const int place = static_cast<int>(random.next() * directions.places());
    const SparseDirections::Packet* packets = directions.packets(phase, place);
    s_.view.look(o_.visibility_, origin(r), r.bsdf, packets, directions.slots() / 8, counts_.bounce,
                 Visibility::kGlossy);
    std::int32_t path = -1;
    for (std::uint64_t left = s_.view.blocked(); left != 0; left &= left - 1) {
      const auto p = static_cast<std::size_t>(std::countr_zero(left));
      for (unsigned bits = s_.view.blocked_lanes(p); bits != 0; bits &= bits - 1) {
        const auto i = static_cast<unsigned>(std::countr_zero(bits));
        const Vec3 w = vec(packets[p].x[i], packets[p].y[i], packets[p].z[i]);
        ++counts_.bounce;
        const auto hit = surface_hit(o_.scene_, o_.visibility_, origin(r), w);
        if (!hit) continue;
        const Bsdf b = bsdf_at(o_.scene_, *hit);
        if (!is_followed(*hit, b)) continue;
        const auto sent = glint(*hit, b, random);
        if (!sent) continue;
        const double cosine = dot(r.bsdf.normal, w);
        const RgbD seen = r.weight * over_cosine(r.bsdf, w) *
                          (cosine / kPi * static_cast<double>(packets[p].weight[i]));
        // Each part stands for its share of the batch's paths.
        if (path < 0) path = new_path(r.row, RgbD{1, 1, 1} * (kPathBatch / PathSums::kParts));
        deposit(path, sent->direction, seen * sent->weight);
      }
    }
  }

  std::int32_t new_path(std::size_t row, const RgbD& own) {
    ++counts_.paths, ++path_key_;
    return s_.sums.add_path(part_, row, own);
  }
  std::int32_t new_shared_path() {
    ++counts_.paths, ++path_key_;
    return s_.sums.add_shared_path(part_);
  }

  void start_diffuse(std::uint64_t i) {
    const EvenPoint u = even_point(i, shift_);
    const std::size_t l = s_.connections.chances().choose(u.value[0]);
    const Receiver& r = tile_.receivers[l];
    const Vec3 w = cosine_direction(r.bsdf.normal, u.value[2], u.value[3]);
    if (!(dot(w, r.bsdf.geometric_normal) > 0)) return;
    PathRandom random(mix_bits(o_.seed_ + 1, i));
    phase_ = static_cast<int>(u.value[1] * static_cast<double>(o_.sky_.phases()));
    ++counts_.bounce;
    const auto hit = surface_hit(o_.scene_, o_.visibility_, origin(r), w);
    if (!hit) return;
    Bsdf b = bsdf_at(o_.scene_, *hit);
    const bool specular = b.is_specular();
    apply_effects(o_.effects_, b);
    // f cos / (q p) of this receiver alone.
    const RgbD alone = r.weight * over_cosine(r.bsdf, w) * (1 / s_.connections.chances().of(l));
    const std::size_t row = r.row;
    if (specular) {
      if (b.delta_count == 0) return;
      const PathEnd end = follow_specular(o_.scene_, o_.visibility_, *hit, b, AtMixed::choose,
                                          random, counts_.bounce);
      if (!end.hit || !(luminance(end.weight) > 0)) return;
      Bsdf at_end = end.bsdf;
      apply_effects(o_.effects_, at_end);
      walk(new_path(row, alone * end.weight), *end.hit, at_end, kAllParts, {1, 1, 1}, 1, false,
           false, random);
      return;
    }
    if (b.has_diffuse() || shares_lobe(b)) {
      s_.connections.look(o_.visibility_, *hit, b, l, counts_);
    }
    if (b.has_diffuse()) {
      const std::int32_t path = new_shared_path();
      s_.connections.add_diffuse(b, s_.sums.weights(path));
      walk(path, *hit, b, kDiffuse, {1, 1, 1}, 1, false, false, random);
    }
    unsigned rest = kLobe | kDelta;
    if (shares_lobe(b) && s_.connections.sees(l)) {
      const std::int32_t path = new_shared_path();
      s_.connections.add_lobe(l, s_.sums.weights(path));
      walk(path, *hit, b, kLobe, {1, 1, 1}, 1, false, follows_lobes(), random);
      rest = kDelta;
    }
    if ((b.has_lobe() && (rest & kLobe) != 0) || b.delta_count > 0) {
      walk(new_path(row, alone), *hit, b, rest, {1, 1, 1}, 1, false, follows_lobes(), random);
    }
  }

  void start_lobe(std::uint64_t i) {
    const EvenPoint u = even_point(i, lobe_shift_);
    const std::size_t l = s_.lobes.choose(u.value[0]);
    const Receiver& r = tile_.receivers[l];
    const auto sample = r.bsdf.sample_lobe(u.value[2], u.value[3]);
    if (!sample || !(dot(sample->direction, r.bsdf.geometric_normal) > 0)) return;
    PathRandom random(mix_bits(o_.seed_ + 2, i));
    phase_ = static_cast<int>(u.value[1] * static_cast<double>(o_.sky_.phases()));
    ++counts_.bounce;
    const auto hit = surface_hit(o_.scene_, o_.visibility_, origin(r), sample->direction);
    if (!hit) return;
    RgbD weight =
        r.weight * lobe_color(r.bsdf, sample->direction) * (1 / (sample->pdf * s_.lobes.of(l)));
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
    walk(new_path(r.row, weight), at, b, kAllParts, {1, 1, 1}, 1, false, false, random);
  }

  // From vertex y, number `bounce` of the path, along the path. `parts` of y's BSDF count. Shared
  // paths have y's diffuse colour in their base weights already. Light that comes straight to y by
  // its single directions counts only where `alone`: otherwise whoever looked this way has followed
  // them already. `looked`: whoever looked this way has followed y's narrow lobe into the open,
  // too.
  void walk(std::int32_t path, SurfaceHit y, Bsdf b, unsigned parts, RgbD tint, int bounce,
            bool alone, bool looked, PathRandom& random) {
    bool in_base = s_.sums.is_shared(path);
    for (;;) {
      const bool narrow = b.has_lobe() && b.lobe_half_width() < o_.narrow_;
      const bool followed = looked && is_followed(y, b);  // its lobe into the open
      const RgbD out = in_base ? RgbD{1, 1, 1} : b.diffuse_out(b.to_viewer);
      const bool diffuse = (parts & kDiffuse) != 0 && b.has_diffuse();
      const bool lobe = (parts & kLobe) != 0 && b.has_lobe();
      const bool more = bounce < o_.effects_.bounces;
      if (diffuse || (lobe && !narrow))
        gather(path, y, b, diffuse, lobe && !narrow, out, tint, more && follows_lobes(), random);

      // One way on.
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
        in_base = looked = false;
        continue;  // the same bounce: nothing was scattered
      }
      in_base = false;
      if (!(dot(w, b.geometric_normal) > 0) || !(luminance(tint) > 0)) return;
      ++counts_.bounce;
      const auto next = surface_hit(o_.scene_, o_.visibility_, leave_surface(y, w), w);
      if (!next) {
        if (sampled_alone && !followed) deposit(path, w, tint);
        return;
      }
      y = *next;
      b = bsdf_at(o_.scene_, y);
      const bool specular = b.is_specular();
      apply_effects(o_.effects_, b);
      alone = sampled_alone;
      looked = follows_lobes() && !sampled_alone;
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
        looked = false;
        y = *end.hit;
        b = end.bsdf;
        apply_effects(o_.effects_, b);
      }
      if (!more) return;
      ++bounce;
    }
  }

  void deposit(std::int32_t path, const Vec3& direction, const RgbD& tint) {
    s_.sums.add_deposit(path, texel_of(direction, o_.sky_.layout().face_size()), tint);
  }

  // What y sees of a phase of the sky, as one column a part. `lobes`: by way of narrow lobes, too,
  // which are a bounce.
  void gather(std::int32_t path, const SurfaceHit& y, const Bsdf& b, bool diffuse, bool lobe,
              const RgbD& out, const RgbD& tint, bool lobes, PathRandom& random) {
    const SparseDirections& directions = o_.sky_.directions();
    const int phase = phase_ >= 0
                          ? phase_
                          : static_cast<int>(random.next() * static_cast<double>(o_.sky_.phases()));
    phase_ = -1;
    const int place = static_cast<int>(random.next() * directions.places());
    const SparseDirections::Packet* packets = directions.packets(phase, place);
    const Vec3 from = y.position + Visibility::kSurfaceOffset * y.geometric_normal;
    s_.view.look(o_.visibility_, from, b, packets, directions.slots() / 8, counts_.shadow);
    if (s_.view.open() != 0 && diffuse) {
      const std::size_t column = s_.sums.add_column(path, phase, tint * out, s_.view.open());
      s_.view.diffuse(b, s_.sums.values(column));
      s_.sums.close_column(column);
    }
    if (s_.view.open() != 0 && lobe) {
      const bool both = l1_norm(b.gloss_second) > 0;
      const std::size_t column =
          s_.sums.add_column(path, phase, tint * b.gloss_first, s_.view.open());
      if (both) s_.sums.add_column(path, phase, tint * b.gloss_second, s_.view.open());
      s_.view.lobe(b, s_.sums.values(column), both ? s_.sums.values(column + 1) : nullptr);
      s_.sums.close_column(column);
      if (both) s_.sums.close_column(column + 1);
    }
    if (s_.view.blocked() != 0 && (lobes || follows_specular())) {
      const std::uint64_t key =
          mix_bits(o_.seed_ + 3, path_key_ * 64 + static_cast<std::uint64_t>(place));
      const RgbD diffuse_out = diffuse ? tint * out : RgbD{};
      follow_blocked(path, from, b, diffuse_out, lobe ? tint : RgbD{}, lobes, packets, key);
    }
  }

  // Some of the directions that mirrors, glass or narrow lobes block, by way of them. `diffuse` and
  // `lobe` are what the parts of the BSDF are multiplied with.
  void follow_blocked(std::int32_t path, const Vec3& from, const Bsdf& b, const RgbD& diffuse,
                      const RgbD& lobe, bool lobes, const SparseDirections::Packet* packets,
                      std::uint64_t key) {
    const unsigned surfaces =
        (lobes ? Visibility::kGlossy : 0u) | (follows_specular() ? Visibility::kSpecular : 0u);
    const std::array<float, 3> start{static_cast<float>(from.x), static_cast<float>(from.y),
                                     static_cast<float>(from.z)};
    for (std::uint64_t left = s_.view.blocked(); left != 0; left &= left - 1) {
      const auto p = static_cast<std::size_t>(std::countr_zero(left));
      const SparseDirections::Packet& d = packets[p];
      const unsigned blocked = s_.view.blocked_lanes(p);
      counts_.specular += std::popcount(blocked);
      const unsigned met = o_.visibility_.occluded8(start, d.x, d.y, d.z, blocked,
                                                    static_cast<Visibility::Surfaces>(surfaces));
      for (unsigned bits = met; bits != 0; bits &= bits - 1) {
        const auto i = static_cast<unsigned>(std::countr_zero(bits));
        PathRandom chance(mix_bits(key, 8 * p + i));
        if (chance.next() * kFollowOneIn >= 1) continue;
        const Vec3 w = vec(d.x[i], d.y[i], d.z[i]);
        ++counts_.specular;
        const auto hit = surface_hit(o_.scene_, o_.visibility_, from, w);
        if (!hit) continue;
        Glint sent;
        if (!follow(*hit, lobes, chance, sent)) continue;
        RgbD through = diffuse * b.diffuse_in(w);
        if (l1_norm(lobe) > 0) through += lobe * lobe_color(b, w);
        deposit(path, sent.direction,
                through * sent.weight * (static_cast<double>(d.weight[i]) * kFollowOneIn));
      }
    }
  }

  // What comes from the open by way of `hit`: through mirrors and glass, or by a narrow lobe.
  bool follow(const SurfaceHit& hit, bool lobes, PathRandom& random, Glint& sent) {
    const Bsdf met = bsdf_at(o_.scene_, hit);
    if (met.delta_count > 0) {
      if (!follows_specular()) return false;
      const PathEnd end = follow_specular(o_.scene_, o_.visibility_, hit, met, AtMixed::pass,
                                          random, counts_.specular);
      sent = {end.direction, end.weight};
      return !end.hit && luminance(end.weight) > 0;
    }
    if (!lobes || !is_followed(hit, met)) return false;
    const auto found = glint(hit, met, random);
    if (found) sent = *found;
    return found.has_value();
  }

  const Interreflection& o_;
  const TileReceivers& tile_;
  Scratch& s_;
  RayCounts& counts_;
  double shift_[4], lobe_shift_[4];
  int part_ = 0;
  int phase_ = -1;              // of the path's first vertex, evenly spread over paths; -1: random
  std::uint64_t path_key_ = 0;  // counts paths
};

Interreflection::Interreflection(const Scene& scene, const Visibility& visibility,
                                 const DirectionTable& table, const Effects& effects,
                                 int resolution, std::uint64_t seed)
    : scene_(scene),
      visibility_(visibility),
      effects_(effects),
      seed_(seed),
      sky_(table, resolution),
      narrow_(4.0 / resolution) {}

Interreflection::~Interreflection() = default;

void Interreflection::begin(Scratch& scratch) const {
  scratch.sums.begin(sky_);
  scratch.paths = 0;
}

void Interreflection::add_direct(std::size_t row, std::size_t channel, const float* texels,
                                 Scratch& scratch) const {
  scratch.sums.add_direct(channel * PathSums::kRows + row, texels);
}

void Interreflection::trace(const TileReceivers& tile, const PathBudget& budget, Scratch& scratch,
                            TileNoise& noise, RayCounts& counts) const {
  Paths paths(*this, tile, scratch, counts);
  if (effects_.bounces < 1 || !paths.any()) return;
  TileNoise own;
  do {
    paths.trace(scratch.paths);
    scratch.paths += kPathBatch;
    scratch.sums.end_batch(kPathBatch, scratch.paths, own);
  } while (own.worst() > budget.noise && scratch.paths < budget.most);
  scratch.sums.finish();
  noise.add(own);
}

void Interreflection::add_to(std::size_t row, std::size_t channel, float* texels,
                             const Scratch& scratch) const {
  if (scratch.paths == 0) return;
  scratch.sums.add_to(channel * PathSums::kRows + row, 1.0f / static_cast<float>(scratch.paths),
                      texels);
}

}  // namespace haarlight
