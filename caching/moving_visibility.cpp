// Rays through a scene that moves.

#include "caching/moving_visibility.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "caching/frame_tracer.h"

namespace haarlight {
namespace {

std::array<float, 3> floats(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

bool same_bits(const Vec3& a, const Vec3& b) { return std::memcmp(&a, &b, sizeof a) == 0; }

std::vector<std::uint32_t> bodies(const AnimatedScene& scene) {
  std::vector<std::uint32_t> body(scene.triangle_count());
  for (std::uint32_t t = 0; t < body.size(); ++t) body[t] = scene.instance_of(t);
  return body;
}

// Beyond any scene in local coordinates.
constexpr double kFar = 16;

}  // namespace

Segment segment_between(const Vec3& from, const Vec3& from_normal, const Vec3& to,
                        const Vec3& to_normal) {
  const Vec3 way = to - from;
  const Vec3 begin = FrameTracer::off_surface(from, from_normal, way);
  const Vec3 between = FrameTracer::off_surface(to, to_normal, -way) - begin;
  const double size = length(between);
  // Where both ends have passed each other there is nothing in between.
  if (!(size > 0) || !(dot(between, way) > 0)) return {floats(begin), {0, 0, 1}, 0};
  return {floats(begin), between * (1 / size), size};
}

Segment segment_towards(const Vec3& from, const Vec3& from_normal, const Vec3& direction) {
  return {floats(FrameTracer::off_surface(from, from_normal, direction)), direction, kFar};
}

MovingVisibility::MovingVisibility(std::vector<std::uint32_t> body) : body_(std::move(body)) {
  std::uint32_t count = 0;
  for (const std::uint32_t b : body_) count = std::max(count, b + 1);
  moved_.assign(count, 0), lately_.assign(count, 0), rested_.assign(count, kRest);
}

MovingVisibility::MovingVisibility(const AnimatedScene& scene) : MovingVisibility(bodies(scene)) {}

bool MovingVisibility::find_moved(const Scene& before, const Scene& now) {
  std::fill(moved_.begin(), moved_.end(), 0);
  bool any = false;
  for (std::size_t v = 0; v < now.position.size(); ++v) {
    if (same_bits(before.position[v], now.position[v]) &&
        same_bits(before.normal[v], now.normal[v])) {
      continue;
    }
    moved_[vertex_body_[v]] = 1, any = true;
  }
  return any;
}

void MovingVisibility::box_moved(const Scene& before, const Scene& now) {
  constexpr double kMax = std::numeric_limits<double>::max();
  std::vector<Box> box(moved_.size(), {{kMax, kMax, kMax}, {-kMax, -kMax, -kMax}});
  const auto add = [](Box& b, const Vec3& low, const Vec3& high) {
    b.low = {std::min(b.low.x, low.x), std::min(b.low.y, low.y), std::min(b.low.z, low.z)};
    b.high = {std::max(b.high.x, high.x), std::max(b.high.y, high.y), std::max(b.high.z, high.z)};
  };
  for (std::size_t v = 0; v < now.position.size(); ++v) {
    const std::uint32_t b = vertex_body_[v];
    if (!moved_[b]) continue;
    for (const Scene* scene : {&before, &now}) {
      const Vec3 p = to_local(scene->position[v]);
      add(box[b], p, p);
    }
  }
  box_.clear();
  for (std::size_t b = 0; b < box.size(); ++b) {
    // Room for what is rounded to float: below 2^-22 of coordinates below 2.
    constexpr Vec3 kRoom{1e-5, 1e-5, 1e-5};
    if (moved_[b]) box_.push_back({box[b].low - kRoom, box[b].high + kRoom});
  }
  // Many boxes cost more than rays do.
  constexpr std::size_t kMostBoxes = 12;
  if (box_.size() <= kMostBoxes) return;
  for (const Box& b : box_) add(box_[0], b.low, b.high);
  box_.resize(1);
}

bool MovingVisibility::may_meet_moved(const Segment& s) const {
  if (!any_moved_) return false;
  const Vec3 from{static_cast<double>(s.origin[0]), static_cast<double>(s.origin[1]),
                  static_cast<double>(s.origin[2])};
  const Vec3 to = from + s.direction * s.length;
  const Vec3 middle = (from + to) * 0.5, half = (to - from) * 0.5;
  for (const Box& b : box_) {
    // The boxes of segment and body apart along an axis, or along one across the segment.
    const Vec3 d = middle - (b.low + b.high) * 0.5, e = (b.high - b.low) * 0.5;
    const Vec3 h{std::abs(half.x), std::abs(half.y), std::abs(half.z)};
    if (std::abs(d.x) > e.x + h.x || std::abs(d.y) > e.y + h.y || std::abs(d.z) > e.z + h.z) {
      continue;
    }
    if (std::abs(d.y * half.z - d.z * half.y) > e.y * h.z + e.z * h.y ||
        std::abs(d.z * half.x - d.x * half.z) > e.x * h.z + e.z * h.x ||
        std::abs(d.x * half.y - d.y * half.x) > e.x * h.y + e.y * h.x) {
      continue;
    }
    return true;
  }
  return false;
}

MovingVisibility::Part MovingVisibility::part(const Scene& scene, bool of_rest) const {
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t t = 0; t < body_.size(); ++t) {
    if ((lately_[body_[t]] == 0) == of_rest) triangles.push_back(t);
  }
  if (triangles.empty()) return nullptr;
  return std::make_unique<Visibility>(scene, local_, triangles);
}

void MovingVisibility::next(AnimatedFrame frame) {
  const Scene& now = frame.scene;
  anew_ = !rest_ && !moving_;
  double farthest = 0;
  if (!anew_) {
    for (const Vec3& p : now.position) {
      const Vec3 l = to_local(p);
      farthest = std::max(farthest, length(l));
      // Negated: what is no number is outside too.
      anew_ = anew_ || !(std::max({std::abs(l.x), std::abs(l.y), std::abs(l.z)}) < 2);
    }
  }
  if (anew_) {
    // Room for bodies to leave the box of the first frame.
    local_ = Visibility::local_frame(now);
    local_.scale *= 0.5;
    extent_ = reach_ = 0;
    vertex_body_.assign(now.position.size(), 0);
    for (std::size_t t = 0; t < now.triangle.size(); ++t) {
      for (const std::uint32_t v : now.triangle[t].vertex) {
        vertex_body_[v] = body_[t];
        const Vec3 l = to_local(now.position[v]);
        extent_ = std::max({extent_, std::abs(l.x), std::abs(l.y), std::abs(l.z)});
        reach_ = std::max(reach_, length(l));
      }
    }
    std::fill(moved_.begin(), moved_.end(), 1);
    std::fill(lately_.begin(), lately_.end(), 0);
    std::fill(rested_.begin(), rested_.end(), kRest);
    any_moved_ = true;
    moving_.reset(), before_.reset();
    rest_ = part(now, true);
    frame_ = std::move(frame);
    return;
  }

  constexpr double kRoom = 1.1;
  if (farthest > reach_) reach_ = kRoom * farthest;
  any_moved_ = find_moved(frame_.scene, now);
  if (any_moved_) box_moved(frame_.scene, now);
  bool regroup = false, long_rest = false;
  for (std::size_t b = 0; b < moved_.size(); ++b) {
    rested_[b] = moved_[b] ? 0 : std::min(rested_[b] + 1, kRest);
    regroup = regroup || (moved_[b] && !lately_[b]);
    long_rest = long_rest || (lately_[b] && rested_[b] == kRest);
  }
  if (regroup || long_rest) {
    for (std::size_t b = 0; b < moved_.size(); ++b) lately_[b] = rested_[b] < kRest;
    before_ = part(frame_.scene, false);
    rest_ = part(now, true);
    moving_ = part(now, false);
  } else if (any_moved_) {
    before_ = std::move(moving_);
    moving_ = part(now, false);
  }
  frame_ = std::move(frame);
}

std::optional<Visibility::Hit> MovingVisibility::first_hit(const Vec3& from,
                                                           const Vec3& direction) const {
  std::optional<Visibility::Hit> hit;
  if (rest_) hit = rest_->first_hit(from, direction);
  if (moving_) {
    const auto other = moving_->first_hit(from, direction);
    if (other && !(hit && hit->distance <= other->distance)) hit = other;
  }
  return hit;
}

SurfaceHit MovingVisibility::surface(const Visibility::Hit& hit, const Vec3& direction) const {
  return surface_at(frame_.scene, holder(hit.triangle), hit, direction);
}

std::array<Vec3, 3> MovingVisibility::corners(std::uint32_t triangle) const {
  return holder(triangle).corners(triangle);
}

unsigned MovingVisibility::occluded8(const std::array<float, 3>& origin, const float* x,
                                     const float* y, const float* z, unsigned lanes) const {
  unsigned blocked = 0;
  if (rest_) blocked = rest_->occluded8_segments(origin, x, y, z, lanes);
  const unsigned open = lanes & ~blocked;
  if (moving_ && open) blocked |= moving_->occluded8_segments(origin, x, y, z, open);
  return blocked;
}

}  // namespace haarlight
