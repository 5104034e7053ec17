// The program haarlight-data: makes the project's own scenes and environments.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/float_check.h"
#include "core/image_io.h"
#include "data_gen/animations.h"
#include "data_gen/environments.h"
#include "data_gen/merl.h"
#include "data_gen/mesh_writer.h"
#include "data_gen/scenes.h"
#include "precompute/scene_import.h"

namespace haarlight::data_gen {
namespace {

template <typename Entry>
std::vector<std::string> names(std::span<const Entry> entries) {
  std::vector<std::string> out;
  for (const Entry& entry : entries) out.emplace_back(entry.name);
  return out;
}

void write_scene(const std::string& name, std::uint64_t seed, const std::filesystem::path& file) {
  const Scene scene = make_scene(name, seed);
  save_scene(file, scene);
  fmt::print("{}: {} triangles, {} materials\n", file.string(), scene.triangle.size(),
             scene.material.size());
}

// Statistics that say how demanding a light is; weighted by solid angle, so only for lat-long.
void print_statistics(const Image& image) {
  struct Pixel {
    double light, weight;
  };
  std::vector<Pixel> pixels;
  double sum = 0, weight_sum = 0, largest = 0;
  for (int y = 0; y < image.height; ++y) {
    const double weight = std::cos(kPi * y / image.height) - std::cos(kPi * (y + 1) / image.height);
    for (int x = 0; x < image.width; ++x) {
      const double light = luminance(RgbD(image.at(x, y)));
      pixels.push_back({light, weight});
      sum += light * weight;
      weight_sum += weight;
      largest = std::max(largest, light);
    }
  }
  std::sort(pixels.begin(), pixels.end(),
            [](const Pixel& a, const Pixel& b) { return a.light > b.light; });
  const auto share = [&](double part) {
    double light = 0, covered = 0;
    for (const Pixel& pixel : pixels) {
      if (covered >= part * weight_sum) break;
      light += pixel.light * pixel.weight;
      covered += pixel.weight;
    }
    return light / sum;
  };
  const double mean = sum / weight_sum;
  fmt::print(
      "  luminance: mean {:.4g}, max {:.4g}, max/mean {:.2g}; brightest 0.1 % of the sphere carry "
      "{:.0f} % of the light, brightest 1 % {:.0f} %\n",
      mean, largest, largest / mean, 100 * share(0.001), 100 * share(0.01));
}

void write_environment(const std::string& name, std::uint64_t seed, const std::string& layout,
                       int size, const std::filesystem::path& file) {
  const Projection projection = projection_from_name(layout).value();
  const EnvironmentModel model = make_environment(name, seed);
  if (file.extension() == ".png" && !model.display_referred) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: \"{}\" is brighter than a PNG can hold, wanted .exr or .hdr",
                            file.string(), name));
  }
  if (size == 0) size = projection == Projection::latlong ? 1024 : 768;
  const Image image = draw_environment(model, projection, size);
  save_image(file, image);
  fmt::print("{}: {} x {}, {}\n", file.string(), image.width, image.height, layout);
  if (projection == Projection::latlong) print_statistics(image);
}

void list() {
  fmt::print("scenes (haarlight-data scene NAME -o FILE.glb):\n");
  for (const SceneEntry& entry : scenes())
    fmt::print("  {:<12} {}\n", entry.name, entry.description);
  fmt::print("\nanimations (haarlight-data animation NAME -o FILE.glb):\n");
  for (const AnimationEntry& entry : animations()) {
    fmt::print("  {:<13} {}\n", entry.name, entry.description);
  }
  fmt::print("\nenvironments (haarlight-data environment NAME -o FILE.exr):\n");
  for (const EnvironmentEntry& entry : environments()) {
    fmt::print("  {:<12} {}\n", entry.name, entry.description);
  }
}

int run(int argc, char** argv) {
  CLI::App app("Makes the scenes and environments that Haarlight's demo, tests and documents use.",
               "haarlight-data");
  app.require_subcommand(1);
  app.footer("Example: haarlight-data environment gallery -o gallery.exr");
  std::string name, layout = "latlong";
  std::filesystem::path file;
  std::uint64_t seed = 1;
  int size = 0;

  CLI::App* scene = app.add_subcommand("scene", "Write a scene as glTF (with camera) or OBJ");
  scene->add_option("NAME", name, "Which scene")->required()->check(CLI::IsMember(names(scenes())));
  scene->add_option("-o,--output", file, "FILE.glb or FILE.obj")->required();
  scene->add_option("--seed", seed, "Another seed gives another scene of the kind")
      ->capture_default_str();

  CLI::App* animation = app.add_subcommand("animation", "Write a scene that moves as glTF");
  animation->add_option("NAME", name, "Which animation")
      ->required()
      ->check(CLI::IsMember(names(animations())));
  animation->add_option("-o,--output", file, "FILE.glb")->required();
  AnimationOptions moving;
  std::filesystem::path mesh;
  animation->add_option("--count", moving.count, "bunnies: how many of the nine move, 1 to 9")
      ->check(CLI::Range(1, 9))
      ->capture_default_str();
  animation->add_option(
      "--mesh", mesh,
      "bunnies, cornell-bunny: FILE.obj, .ply, .glb or .gltf in place of the bunny");

  CLI::App* environment =
      app.add_subcommand("environment", "Write an environment as a picture of radiance");
  environment->add_option("NAME", name, "Which environment")
      ->required()
      ->check(CLI::IsMember(names(environments())));
  environment->add_option("-o,--output", file, "FILE.exr or FILE.hdr; FILE.png for labels only")
      ->required();
  environment->add_option("--projection", layout, "Layout of the picture")
      ->check(CLI::IsMember({"latlong", "angular", "vertical-cross"}))
      ->capture_default_str();
  environment
      ->add_option("--size", size,
                   "Width in pixels, 8 to 16384 [default: 1024 for latlong, else 768]")
      ->check(CLI::Range(8, 16384));
  environment->add_option("--seed", seed, "Another seed gives another light of the kind")
      ->capture_default_str();

  CLI::App* brdf = app.add_subcommand(
      "brdf", "Write the BRDF of a red lacquer as a table in the binary form of the MERL database");
  brdf->add_option("-o,--output", file, "FILE.binary")->required();
  double exponent = Lacquer().exponent;
  brdf->add_option("--exponent", exponent, "Of its highlight, 1 to 10000")
      ->check(CLI::Range(1.0, 1e4))
      ->capture_default_str();

  CLI::App* listing = app.add_subcommand("list", "List scenes, animations and environments");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (*scene) write_scene(name, seed, file);
  if (*animation) {
    if (!mesh.empty()) moving.figure = import_scene(mesh);
    const std::size_t triangles = save_animation(file, name, moving);
    fmt::print("{}: {} triangles\n", file.string(), triangles);
  }
  if (*environment) write_environment(name, seed, layout, size, file);
  if (*brdf) {
    Lacquer lacquer;
    lacquer.exponent = exponent;
    write_merl(file, lacquer);
    fmt::print("{}: 90 x 90 x 180 cells\n", file.string());
  }
  if (*listing) list();
  return 0;
}

}  // namespace
}  // namespace haarlight::data_gen

int main(int argc, char** argv) {
  try {
    haarlight::check_float_arithmetic();
    return haarlight::data_gen::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "haarlight-data: {}\n", error.what());
    return 1;
  }
}
