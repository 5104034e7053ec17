// Writes one small file of the kind that its name says, for the tests of faults: FILE.json a
// recorded motion, FILE.csv metrics, FILE.exr, .hdr or .png a picture. Exit codes as haarlight's.

#include <fmt/format.h>

#include "core/error.h"
#include "core/image_io.h"
#include "prt/metrics_csv.h"
#include "prt/motion_file.h"

int main(int argc, char** argv) {
  using namespace haarlight;
  if (argc != 2) return 2;
  const std::filesystem::path file = argv[1];
  try {
    if (file.extension() == ".json") {
      MotionRecording recording;
      recording.environments = {"a.exr"};
      recording.frames.resize(50);
      for (std::size_t f = 0; f < 50; ++f)
        recording.frames[f].light.blend = 0.02 * static_cast<double>(f);
      save_motion_file(file, recording);
    } else if (file.extension() == ".csv") {
      MetricsCsvWriter table(file);
      for (int frame = 0; frame < 3; ++frame) {
        FrameMetrics metrics;
        metrics.frame = frame;
        table.add(metrics);
      }
      table.commit();
    } else {
      Image picture(40, 30);
      for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
        picture.pixels[i] = Rgb{1, 2, 3} * static_cast<float>(i % 17);
      }
      save_image(file, picture);
    }
  } catch (const Error& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return 1;
  }
  return 0;
}
