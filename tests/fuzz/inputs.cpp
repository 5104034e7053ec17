// Environments, recordings and scenes from any bytes.

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "prt/motion_file.h"
#include "tests/fuzz/targets.h"
#include "wavelet/environment.h"

namespace haarlight::fuzz {

Outcome environment(Bytes bytes) {
  if (bytes.empty()) return Outcome::refused;
  constexpr const char* kNames[] = {"fuzz.exr", "fuzz.hdr", "fuzz.png"};
  const char* name = kNames[std::to_integer<std::size_t>(bytes[0]) % 3];
  return with_file(name, bytes.subspan(1), [](const std::filesystem::path& file) {
    const Environment environment = load_environment(file);
    for (const Rgb& pixel : environment.picture().pixels) {
      if (!is_finite(pixel) || pixel.r < 0 || pixel.g < 0 || pixel.b < 0) {
        fault("a pixel came in that is not finite, or negative");
      }
    }
    // Cells are 16 a texel and pixel: what is large is left to the tests of the sampler.
    if (environment.picture().pixels.size() > 65536) return;
    const EnvironmentSampler sampler(environment, 4);
    Cubemap map(4);
    sampler.project(rotation_y(1.0), map);
  });
}

Outcome recording(Bytes bytes) {
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    const MotionRecording once = parse_motion(text, "fuzz.json");
    const MotionRecording twice = parse_motion(motion_text(once), "fuzz.json");
    if (once.frames.size() != twice.frames.size()) fault("a recording lost frames");
  } catch (const Error& error) {
    const std::string what = error.what();
    if (what.find("fuzz.json") == std::string::npos) fault("an error that names no file: " + what);
    return Outcome::refused;
  } catch (const std::exception& error) {
    fault(std::string("an exception that is no Error: ") + error.what());
  }
  return Outcome::accepted;
}

}  // namespace haarlight::fuzz
