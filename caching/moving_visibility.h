// Rays through a scene that moves: what rests and what moves, in two parts.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "caching/animated_scene.h"
#include "precompute/surface.h"
#include "precompute/visibility.h"

namespace haarlight {

/// A ray between two places, local units of MovingVisibility.
struct Segment {
  std::array<float, 3> origin{};
  Vec3 direction;  ///< unit
  double length = 0;
};
/// From just off one surface to just off another. Of no length where they touch.
Segment segment_between(const Vec3& from, const Vec3& from_normal, const Vec3& to,
                        const Vec3& to_normal);
/// From just off a surface on, as far as the scene goes.
Segment segment_towards(const Vec3& from, const Vec3& from_normal, const Vec3& direction);

/// The current frame of an animation, ready for rays, and what moved since the one before. Bodies
/// that moved lately lie in a part of their own, built anew each frame; all others in one that is
/// built when a body starts to move or has rested long. Local coordinates stay the same from frame
/// to frame, so that a ray past what has not moved finds the same bits again. Nothing need be known
/// beforehand. Rays may be traced from any number of threads; next() from one.
class MovingVisibility {
 public:
  /// `body` names the body of each triangle, as AnimatedScene::instance_of().
  explicit MovingVisibility(std::vector<std::uint32_t> body);
  explicit MovingVisibility(const AnimatedScene& scene);

  /// Goes on to a frame. Vertices are compared by their bits: a body has moved where one of its
  /// positions or normals has changed. Throws as Visibility.
  void next(AnimatedFrame frame);

  const AnimatedFrame& frame() const { return frame_; }
  /// Whether everything is new: the first frame, or the scene has outgrown its local coordinates.
  bool anew() const { return anew_; }
  bool any_moved() const { return any_moved_; }
  bool moved(std::uint32_t triangle) const { return moved_[body_[triangle]] != 0; }
  std::uint32_t body_of(std::uint32_t triangle) const { return body_[triangle]; }

  Vec3 to_local(const Vec3& world) const { return (world - local_.center) * local_.scale; }
  /// Local units a metre.
  double scale() const { return local_.scale; }
  /// Half the longest edge of the first frame's bounding box, local units: in [1/2, 1).
  double extent() const { return extent_; }
  /// All of the scene is within this of the origin, local units. Grows where it must, so that it
  /// stays the same in most frames.
  double reach() const { return reach_; }

  std::optional<Visibility::Hit> first_hit(const Vec3& from, const Vec3& direction) const;
  SurfaceHit surface(const Visibility::Hit& hit, const Vec3& direction) const;
  /// Corners of a triangle, local, as rays find them.
  std::array<Vec3, 3> corners(std::uint32_t triangle) const;

  /// Whether anything blocks a segment: the rest or what moves. One of no length is free.
  bool occluded(const Segment& s) const { return occluded_by_moving(s) || occluded_by_rest(s); }
  bool occluded_by_rest(const Segment& s) const { return meets(rest_, s); }
  /// By the bodies that moved lately, where they are now and where they were in the frame before.
  /// All that moved since are among them.
  bool occluded_by_moving(const Segment& s) const { return meets(moving_, s); }
  bool occluded_by_moving_before(const Segment& s) const { return meets(before_, s); }
  /// Whether a segment comes near the boxes of what has moved since the frame before, then or now.
  /// If not, all that it meets is what it met: no ray is needed to say so.
  bool may_meet_moved(const Segment& s) const;
  /// Eight segments of one origin at once, as Visibility::occluded8_segments: faster where many
  /// are free, but not bit by bit what occluded() says of rays that graze an edge.
  unsigned occluded8(const std::array<float, 3>& origin, const float* x, const float* y,
                     const float* z, unsigned lanes) const;
  /// Eight rays of their own origins, as Visibility has them.
  void first_hits8(Visibility::Rays8& rays, Visibility::Hits8& hits, bool coherent) const {
    if (rest_) rest_->first_hits8(rays, hits, coherent);
    if (moving_) moving_->first_hits8(rays, hits, coherent);
  }

 private:
  using Part = std::unique_ptr<Visibility>;
  static constexpr int kRest = 16;  // frames without motion until a body belongs to the rest

  static bool meets(const Part& part, const Segment& s) {
    return part && s.length > 0 && part->occluded(s.origin, s.direction, s.length);
  }
  struct Box {
    Vec3 low, high;
  };
  void box_moved(const Scene& before, const Scene& now);
  bool find_moved(const Scene& before, const Scene& now);
  Part part(const Scene& scene, bool of_rest) const;
  const Visibility& holder(std::uint32_t triangle) const {
    return *(lately_[body_[triangle]] ? moving_ : rest_);
  }

  std::vector<std::uint32_t> body_;         // by triangle
  std::vector<std::uint32_t> vertex_body_;  // by vertex
  std::vector<char> moved_, lately_;        // by body: since the frame before; in the moving part
  std::vector<int> rested_;                 // by body: frames since it moved
  AnimatedFrame frame_;
  Visibility::LocalFrame local_;
  double extent_ = 1, reach_ = 1;
  bool anew_ = true, any_moved_ = false;
  std::vector<Box> box_;         // of moved bodies, or one of all
  Part rest_, moving_, before_;  // empty where there are no triangles
};

}  // namespace haarlight
