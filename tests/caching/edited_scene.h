// A small scene to edit at random, for tests of what is kept from frame to frame.

#pragma once

#include <cstdint>
#include <vector>

#include "caching/animated_scene.h"
#include "precompute/random.h"
#include "tests/precompute/shapes.h"

namespace haarlight {

// A room, some balls, a shelf, a lamp and a shining panel. Body of a triangle: 0 the room, then one
// each.
class EditedScene {
 public:
  static constexpr int kBalls = 4;

  explicit EditedScene(std::uint64_t seed) : random_(seed) {
    Scene& s = frame_.scene;
    s = shapes::empty_scene();
    s.material.resize(4);
    for (Material& m : s.material) m.albedo = {0.6f, 0.5f, 0.4f};
    s.material[3].albedo = {0, 0, 0};
    shapes::add_quad(s, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
    shapes::add_quad(s, {-1, 0, -1}, {2, 0, 0}, {0, 2, 0}, 1);
    shapes::add_quad(s, {-1, 0, 1}, {0, 0, -2}, {0, 2, 0});
    body_.assign(s.triangle.size(), 0);
    first_vertex_.push_back(0);
    for (int b = 0; b < kBalls; ++b) {
      first_vertex_.push_back(s.position.size());
      shapes::add_sphere(s, {0.4 * b - 0.6, 0.3, 0.2 * (b % 2)}, 0.15, 1, 2);
      body_.resize(s.triangle.size(), static_cast<std::uint32_t>(b + 1));
    }
    first_vertex_.push_back(s.position.size());
    shapes::add_quad(s, {-0.2, 1.8, -0.2}, {0.4, 0, 0}, {0, 0, 0.4}, 3);  // faces down
    body_.resize(s.triangle.size(), kBalls + 1);
    first_vertex_.push_back(s.position.size());
    s.camera = look_at({0.2, 0.9, 2.5}, {0, 0.5, 0}, 0.9, 24, 18);
    frame_.emission.resize(s.material.size());
    frame_.emission[3].radiance = {4, 4, 3};
    SceneLight lamp;
    lamp.position = {0.3, 1.2, 0.5};
    lamp.intensity = {2, 2, 2};
    frame_.light.push_back(lamp);
  }

  const AnimatedFrame& frame() const { return frame_; }
  const std::vector<std::uint32_t>& body() const { return body_; }

  // One edit: a body, a vertex, a lamp, the background, a material, the camera, or none.
  void edit() {
    Scene& s = frame_.scene;
    ++frame_.frame;
    const double what = random_.next();
    if (what < 0.45) {
      const auto b = 1 + static_cast<std::size_t>(random_.next() * (kBalls + 1));
      const double size = random_.next() < 0.5 ? 0.02 : 0.4;
      Vec3 way = vector() * size;
      Vec3 middle;
      for (std::size_t v = first_vertex_[b]; v < first_vertex_[b + 1]; ++v) middle = s.position[v];
      // Back towards the room where it would leave it.
      if (length(middle + way - Vec3{0, 0.7, 0}) > 1.3) way = (Vec3{0, 0.7, 0} - middle) * 0.3;
      for (std::size_t v = first_vertex_[b]; v < first_vertex_[b + 1]; ++v) {
        s.position[v] = s.position[v] + way;
      }
    } else if (what < 0.55) {  // deforms
      const auto b = 1 + static_cast<std::size_t>(random_.next() * kBalls);
      const double bend = 1 + 0.2 * (random_.next() - 0.5);
      const Vec3 at = s.position[first_vertex_[b]];
      for (std::size_t v = first_vertex_[b]; v < first_vertex_[b + 1]; ++v) {
        s.position[v].y = at.y + (s.position[v].y - at.y) * bend;
      }
    } else if (what < 0.65) {
      frame_.light[0].position = frame_.light[0].position + vector() * 0.1;
    } else if (what < 0.72) {
      const double x = random_.next();
      frame_.light[0].intensity = x < 0.2 ? RgbD{} : RgbD{3 * x, 2 * x, x};
    } else if (what < 0.8) {
      const auto m = static_cast<std::size_t>(random_.next() * 3);
      const auto c = [&] { return static_cast<float>(random_.next()); };
      s.material[m].albedo = random_.next() < 0.1 ? Rgb{} : Rgb{c(), c(), c()};
    } else if (what < 0.85) {
      const double x = random_.next();
      frame_.emission[3].radiance = x < 0.3 ? RgbD{} : RgbD{4 * x, 3 * x, x};
    } else if (what < 0.9) {
      frame_.background = random_.next() < 0.6 ? RgbD{} : RgbD{0.2, 0.3, 0.5};
    } else if (what < 0.95) {
      s.camera = look_at(Vec3{0.2, 0.9, 2.5} + vector() * 0.5, {0, 0.5, 0}, 0.9, 24, 18);
    }
  }
  double next() { return random_.next(); }

 private:
  Vec3 vector() { return {2 * random_.next() - 1, 2 * random_.next() - 1, 2 * random_.next() - 1}; }
  AnimatedFrame frame_;
  std::vector<std::uint32_t> body_;
  std::vector<std::size_t> first_vertex_;
  PathRandom random_;
};

}  // namespace haarlight
