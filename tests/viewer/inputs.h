// Small files for the viewer's tests.

#pragma once

#include <filesystem>
#include <numeric>
#include <random>

#include "core/image_io.h"
#include "prt/transport_writer.h"
#include "tests/prt/fixtures.h"
#include "wavelet/environment.h"

namespace haarlight::fixtures {

inline void write_small_transport(const std::filesystem::path& file, int face = 8, int width = 24,
                                  int height = 16) {
  const SmallTransport small = small_transport(face, width, height, 5);
  TransportWriter writer(file, small.info, {small.thresholds, "test", false});
  const int tiles = ((width + 7) / 8) * ((height + 7) / 8);
  for (int tile = 0; tile < tiles; ++tile) {
    writer.write_tile(tile, small.tiles[static_cast<std::size_t>(tile)]);
  }
  writer.finish(R"({"made_by": "test"})");
}

inline Environment random_sky(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  Image picture(64, 32);
  for (Rgb& pixel : picture.pixels) pixel = {uniform(random), uniform(random), uniform(random)};
  picture.at(20, 8) = {200, 180, 150};
  return Environment(picture);
}

inline void write_sky(const std::filesystem::path& file, std::uint64_t seed) {
  save_image(file, random_sky(seed).picture());
}

}  // namespace haarlight::fixtures
