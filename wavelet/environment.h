// Distant light: loading it, checking it at the door, turning it, sampling it onto a cube map.

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "core/image.h"
#include "core/vec.h"
#include "wavelet/cubemap.h"
#include "wavelet/projection.h"

namespace haarlight {

/// What the gate repaired or noticed while an environment was read.
struct EnvironmentReport {
  std::int64_t negative_pixels = 0;    ///< pixels with a negative channel, made 0
  double smallest = 0;                 ///< the most negative value met
  std::int64_t not_finite_pixels = 0;  ///< NaN or infinite, made 0
};

struct EnvironmentOptions {
  std::optional<Projection> projection;  ///< none: by the shape of the picture
  double scale = 1;                      ///< multiplies radiance; > 0
};

/// Radiance arriving from every direction, W m^-2 sr^-1, linear Rec.709.
class Environment {
 public:
  /// Takes a picture in. Negative radiance (lossy EXR, resize ringing) becomes 0 and is counted.
  /// Up to 1 pixel in 1000 may be NaN or infinite: they become 0 and are counted; more throw
  /// Error{format}. A value above 1.8e18 (its square leaves float) throws Error{format}, a shape
  /// that is no known projection Error{invalid_argument}. `name` is used in messages.
  Environment(Image picture, const EnvironmentOptions& options = {},
              const std::string& name = "environment");

  Projection projection() const { return projection_; }
  const Image& picture() const { return picture_; }
  const EnvironmentReport& report() const { return report_; }

  /// Radiance from one direction (of any length), bilinear in the picture; for backgrounds. Throws
  /// Error{invalid_argument} unless it is finite and not 0.
  Rgb radiance(const Vec3& along) const;

 private:
  Image picture_;
  Projection projection_ = Projection::latlong;
  EnvironmentReport report_;
};

/// load_image, then the gate. Throws as both do, with the file's name in the message.
Environment load_environment(const std::filesystem::path& file,
                             const EnvironmentOptions& options = {});

/// An environment made ready to be turned and averaged onto a cube map, quickly, every frame.
///
/// The picture is cut into cells of nearly equal solid angle, about 16 a texel (more for faces
/// below 8, 10 at 256, 4 from 512 on): pixels that are bigger are split, bilinear inside but
/// keeping the pixel's energy; smaller ones are merged with their neighbours, except where that
/// would move a bright light. A cell holds energy (radiance x solid angle), solid angle and centre.
/// project() turns every cell and hands its energy to the texels below its footprint, across face
/// edges too, then divides by the solid angle that arrived in the same way where light is smooth,
/// and by the texel's where it is not. What all directions have at least is left out of that and
/// added at the end. So a constant environment stays constant to the bit, a light of one
/// pixel keeps its energy within 2 % however it is turned, moves smoothly, and neither vanishes nor
/// flickers. 32 bytes a cell.
class EnvironmentSampler {
 public:
  /// `face_size` is n, a power of two in [1, 1024]. Throws Error{invalid_argument} otherwise.
  EnvironmentSampler(const Environment& environment, int face_size);

  int face_size() const { return n_; }
  std::size_t cell_count() const { return light_.size(); }

  /// Mean radiance of each texel of the environment turned by `rotation`: light that came from
  /// direction d comes from rotation * d. `out` has n = face_size(), otherwise throws
  /// Error{invalid_argument}, and for a rotation whose rows are not of length 1. No heap use. The
  /// same bits on any number of threads. Uses scratch of
  /// this object: not to be called from two threads at once.
  void project(const Rotation& rotation, Cubemap& out) const;

 private:
  /// Red, green and blue energy and solid angle, of a cell or of what a texel got.
  typedef float Sums __attribute__((vector_size(16)));

  void add_part(const Rotation& rotation, int part) const;
  /// Texels of a part's sums, and what a 2 x 2 footprint at the last one touches.
  std::size_t part_stride() const {
    return 6 * texel_solid_angle_.size() + static_cast<std::size_t>(n_) + 1;
  }

  int n_;
  int parts_ = 0;                         // runs that the cells are cut in, whatever the threads
  std::vector<float> x_, y_, z_;          // unit direction of a cell's centre
  std::vector<float> width_;              // of a cell, in texels at the middle of a face
  Rgb everywhere_;                        // radiance that all directions have at least
  std::vector<Sums> light_;               // what a cell carries beside that
  std::vector<float> texel_solid_angle_;  // of one face, exact
  mutable std::vector<Sums> scratch_;     // [part][texel]
};

/// One call: texel averages of `environment` turned by `rotation`.
Cubemap environment_to_cubemap(const Environment& environment, int face_size,
                               const Rotation& rotation = {});

}  // namespace haarlight
