// Calls of the library with numbers of any kind.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>

#include "core/error.h"
#include "prt/lighting_tracker.h"
#include "prt/motion.h"
#include "prt/picture_relighter.h"
#include "prt/tonemap.h"
#include "prt/wavelet_weight.h"
#include "tests/fuzz/targets.h"
#include "tests/prt/fixtures.h"

namespace haarlight::fuzz {
namespace {

/// Values of any bits, one after the other; zeros at the end.
class Stream {
 public:
  explicit Stream(Bytes bytes) : bytes_(bytes) {}
  template <typename T>
  T next() {
    T value{};
    const std::size_t size = std::min(sizeof value, bytes_.size());
    if (size > 0) std::memcpy(&value, bytes_.data(), size);
    bytes_ = bytes_.subspan(size);
    return value;
  }
  bool done() const { return bytes_.empty(); }
  /// Mostly what may be, now and then any bits.
  float radiance() {
    const auto kind = next<std::uint8_t>();
    if (kind < 16) return next<float>();
    if (kind < 48) return 0;
    return std::ldexp(static_cast<float>(next<std::int8_t>()), kind % 32 - 20);
  }

 private:
  Bytes bytes_;
};

/// Transports that all runs share: of pictures (false) and meshes.
const Transport& shared_transport(int face, bool mesh) {
  static std::map<std::pair<int, bool>, std::unique_ptr<const Transport>> made;
  auto& place = made[{face, mesh}];
  if (!place) {
    const fixtures::SmallTransport small =
        mesh ? fixtures::small_mesh_transport(face, fixtures::bumpy_sphere(60, 1), 1)
             : fixtures::small_transport(face, 12, 9, 1);
    place = std::make_unique<const Transport>(
        build_transport(small.info, small.tiles, small.thresholds));
  }
  return *place;
}

LightingOptions options_from(Stream& in, const HaarLayout& layout) {
  LightingOptions options;
  options.method = static_cast<LightingMethod>(in.next<std::uint8_t>() % 4);
  options.band_choice = static_cast<BandChoice>(in.next<std::uint8_t>() % 2);
  options.wavelets = in.next<std::uint8_t>() < 8 ? in.next<int>() : 1 + in.next<std::uint8_t>();
  const auto weights = in.next<std::uint8_t>();
  if (weights < 64) {
    options.weights.assign(static_cast<std::size_t>(layout.size()) + (weights < 4 ? 1u : 0u), 1.0f);
    for (float& w : options.weights) w = weights < 32 ? std::abs(in.radiance()) : in.radiance();
  }
  return options;
}

std::vector<Rgb> target_from(Stream& in, const HaarLayout& layout) {
  std::vector<Rgb> target(static_cast<std::size_t>(layout.size()));
  if (in.next<std::uint8_t>() < 2) target.pop_back();
  for (Rgb& c : target) c = {in.radiance(), in.radiance(), in.radiance()};
  return target;
}

// A call that may be refused, and then has changed nothing.
template <typename Call>
bool taken(const Call& call) {
  try {
    call();
    return true;
  } catch (const Error& error) {
    const std::string what = error.what();
    if (what.empty() || what.find('\n') != std::string::npos) fault("no line: " + what);
    return false;
  } catch (const std::exception& error) {
    fault(std::string("an exception that is no Error: ") + error.what());
  }
}

void relight(Stream& in) {
  const int face = 1 << (in.next<std::uint8_t>() % 3);
  const Transport& transport = shared_transport(face, in.next<std::uint8_t>() % 2 != 0);
  const HaarLayout& layout = transport.layout();
  std::unique_ptr<LightingTracker> tracker;
  taken([&] { tracker = std::make_unique<LightingTracker>(layout, options_from(in, layout)); });
  if (!tracker) return;
  PictureRelighter relighter(transport);
  for (int call = 0; call < 40 && !in.done(); ++call) {
    const LightingUpdate* update = nullptr;
    const std::vector<Rgb> before(tracker->shown().begin(), tracker->shown().end());
    switch (in.next<std::uint8_t>() % 6) {
      case 0:
        taken([&] { tracker->set_options(options_from(in, layout)); });
        break;
      case 1:
        taken([&] { update = &tracker->start_exact(target_from(in, layout)); });
        break;
      case 2:
        relighter.expect_resets(in.next<std::uint8_t>() % 2 != 0);
        break;
      case 3: {
        Camera camera = relighter.camera();
        double* numbers[] = {&camera.position.x,           &camera.position.y,
                             &camera.position.z,           &camera.vertical_fov,
                             &camera.orientation.row[0].x, &camera.orientation.row[2].z};
        *numbers[in.next<std::uint8_t>() % 6] = in.next<double>();
        camera.width = in.next<std::uint8_t>() < 16 ? in.next<int>() : in.next<std::uint8_t>() % 64;
        camera.height = in.next<std::uint8_t>() % 64;
        if (camera.width > 256) camera.width = -camera.width;  // room is not what is looked for
        const Camera old = relighter.camera();
        LightingUpdate none;
        if (!taken([&] {
              relighter.set_camera(camera);
              relighter.apply(none);
            })) {
          taken([&] { relighter.set_camera(old); });
        }
        break;
      }
      default:
        taken([&] { update = &tracker->advance(target_from(in, layout)); });
        break;
    }
    if (update) {
      relighter.apply(*update);
    } else if (!std::equal(before.begin(), before.end(), tracker->shown().begin())) {
      fault("a call that was refused changed what is shown");
    }
    for (const Rgb& c : tracker->shown()) {
      if (!is_finite(c)) fault("what is shown is not finite");
    }
  }
}

void environment_calls(Stream& in) {
  const int height = 1 + in.next<std::uint8_t>() % 16;
  const int width = in.next<std::uint8_t>() < 200 ? 2 * height : 1 + in.next<std::uint8_t>() % 40;
  Image picture(width, height);
  for (Rgb& pixel : picture.pixels) pixel = {in.radiance(), in.radiance(), in.radiance()};
  taken([&] {
    EnvironmentOptions options;
    if (in.next<std::uint8_t>() < 64) options.scale = in.next<double>();
    const Environment environment(std::move(picture), options);
    const EnvironmentSampler sampler(environment, 4);
    Cubemap map(4);
    sampler.project(rotation_y(in.next<double>()), map);
    environment.radiance({in.next<double>(), in.next<double>(), in.next<double>()});
  });
}

void tonemap_calls(Stream& in) {
  Image picture(1 + in.next<std::uint8_t>() % 8, 1 + in.next<std::uint8_t>() % 8);
  for (Rgb& pixel : picture.pixels) pixel = {in.next<float>(), in.next<float>(), in.next<float>()};
  const double stops = in.next<double>();
  taken([&] {
    auto_exposure_ev(picture);
    false_colour(picture, stops);
    for (const Rgb& pixel : tonemap(picture, {}).pixels) {
      if (!is_finite(pixel)) fault("a display's pixel is not finite");
    }
  });
}

}  // namespace

Outcome api(Bytes bytes) {
  Stream in(bytes);
  switch (in.next<std::uint8_t>() % 8) {
    case 0:
      environment_calls(in);
      break;
    case 1:
      tonemap_calls(in);
      break;
    default:
      relight(in);
      break;
  }
  return Outcome::accepted;
}

}  // namespace haarlight::fuzz
