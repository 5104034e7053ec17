// haarlight-bench-view: what factored BRDFs leave of themselves, and of pictures.
//
//   curve      error of a BRDF against its number of terms, for Lambert, Phong, GGX and a table
//   pictures   a mesh with terms against a path tracer that knows nothing of them

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image_io.h"
#include "precompute/brdf_factors.h"
#include "precompute/measured_brdf.h"
#include "precompute/scene_import.h"
#include "prt/motion.h"
#include "prt/picture_relighter.h"
#include "prt/tonemap.h"
#include "tests/reference/path_tracer.h"
#include "wavelet/environment.h"

namespace haarlight {
namespace {

Material phong(float exponent, float diffuse, float specular) {
  Material m;
  m.albedo = {diffuse, diffuse, diffuse};
  m.specular = {specular, specular, specular};
  m.exponent = exponent;
  return m;
}

Material ggx(float roughness, float metallic) {
  Material m;
  m.model = SurfaceModel::metallic_roughness;
  m.albedo = {0.9f, 0.6f, 0.3f};
  m.roughness = roughness, m.metallic = metallic;
  return m;
}

// CSV: material, terms, error; terms as wanted, pairs whole.
void print_curve(const std::string& table) {
  std::vector<std::pair<std::string, Material>> materials{
      {"Lambert", phong(1, 0.5f, 0)},
      {"Phong 5", phong(5, 0, 0.8f)},
      {"Phong 30", phong(30, 0, 0.8f)},
      {"Phong 30 over Lambert (0.4 and 0.4)", phong(30, 0.4f, 0.4f)},
      {"Phong 1000", phong(1000, 0, 0.8f)},
      {"GGX metal, roughness 0.3", ggx(0.3f, 1)},
      {"GGX metal, roughness 0.6", ggx(0.6f, 1)},
      {"GGX dielectric over diffuse, roughness 0.4", ggx(0.4f, 0)}};
  if (!table.empty()) {
    Material m;
    m.model = SurfaceModel::measured;
    m.measured = std::make_shared<const MeasuredBrdf>(read_merl(table));
    materials.emplace_back("table, MERL's form (lacquer)", m);
  }
  fmt::print("material,terms,error\n");
  for (const auto& [name, material] : materials) {
    const BrdfSpectrum spectrum(material, false);
    for (const int terms : {1, 2, 3, 4, 6, 8, 9, 12, 16, 20, 25, 30, 36, 49, 64}) {
      fmt::print("\"{}\",{},{:.5f}\n", name, terms, spectrum.error(terms));
    }
  }
}

struct Pictures {
  std::filesystem::path scene, folder;
  std::vector<std::filesystem::path> transports;
  std::vector<std::string> environments;
  int width = 320, height = 200, samples = 64;
  int bounces = 10'000;  // of the reference
  int light_face = 0;    // of the reference's light; 0: the transports'
  double degrees = 40;
};

double square(const RgbD& c) { return c.r * c.r + c.g * c.g + c.b * c.b; }

void save_display(const std::filesystem::path& file, const Image& picture, double exposure) {
  TonemapOptions options;
  options.exposure_ev = exposure;
  save_image(file, tonemap(picture, options));
}

// Every environment from three views: a line for each transport, and pictures.
void compare_pictures(const Pictures& p) {
  const Scene scene = import_scene(p.scene);
  std::vector<Transport> transports;
  for (const std::filesystem::path& file : p.transports) {
    transports.push_back(Transport::open(file));
    if (!transports.back().info().mesh) {
      throw Error(ErrorKind::invalid_argument,
                  fmt::format("{}: is of a fixed view, expected one of vertices", file.string()));
    }
  }
  const TransportInfo& first = transports.front().info();
  Camera camera = first.camera;
  camera.width = p.width, camera.height = p.height;
  const Vec3 middle = bounding_sphere(*first.mesh).center;
  std::filesystem::create_directories(p.folder);
  fmt::print("environment,view,transport,terms,relative_rmse,reference_noise\n");
  for (const std::string& file : p.environments) {
    const std::string name = std::filesystem::path(file).stem().string();
    const Environment environment = load_environment(file);
    MotionOptions still;
    still.kind = MotionKind::still;
    Motion motion(still, transports.front().layout(), environment);
    Cubemap map = motion.cubemap(0);
    if (p.light_face > 0) {
      map = Cubemap(p.light_face);
      EnvironmentSampler(environment, p.light_face).project(rotation_y(0), map);
    }
    const reference::Sky sky(map);
    const std::vector<Rgb> light(motion.coefficients(0).begin(), motion.coefficients(0).end());
    std::optional<double> exposure;  // of the light, whatever the view
    for (int view = 0; view < 3; ++view) {
      const Camera from = turned_about(camera, middle, (view - 1) * p.degrees * kPi / 180);
      const std::string stem = fmt::format("{}_{}", name, view);
      reference::PathOptions options;
      options.samples = p.samples;
      options.max_bounces = p.bounces;
      const auto truth = reference::PathTracer(scene, sky, options).picture(from);
      const Image of_truth = reference::picture_of(truth, from.width, from.height);
      if (!exposure) exposure = auto_exposure_ev(of_truth);
      save_display(p.folder / (stem + "_reference.png"), of_truth, *exposure);
      for (std::size_t t = 0; t < transports.size(); ++t) {
        const Image shown = relight_picture_once(transports[t], light, from);
        const std::string of = p.transports[t].stem().string();
        save_display(p.folder / fmt::format("{}_{}.png", stem, of), shown, *exposure);
        double difference = 0, noise = 0, energy = 0;
        for (std::size_t i = 0; i < truth.size(); ++i) {
          difference += square(RgbD(shown.pixels[i]) - truth[i].mean);
          energy += square(truth[i].mean);
          noise += truth[i].variance.r + truth[i].variance.g + truth[i].variance.b;
        }
        // Noise of the reference adds to the difference, and to the energy.
        energy = std::max(energy - noise, 1e-30);
        fmt::print("{},{},{},{},{:.4f},{:.4f}\n", name, view, of, transports[t].info().terms,
                   std::sqrt(std::max(0.0, difference - noise) / energy),
                   std::sqrt(noise / energy));
        std::fflush(stdout);
      }
    }
  }
}

int run(int argc, char** argv) {
  CLI::App app("What factored BRDFs leave of themselves, and of pictures.", "haarlight-bench-view");
  app.require_subcommand(1);
  std::string table;
  CLI::App* curve = app.add_subcommand("curve", "CSV of error against terms");
  curve->add_option("--merl", table, "a table in MERL's form, too");
  Pictures p;
  CLI::App* pictures = app.add_subcommand("pictures", "CSV of errors against a path tracer");
  pictures->add_option("SCENE", p.scene)->required();
  pictures->add_option("TRANSPORT", p.transports, "of its vertices; one or more")->required();
  pictures->add_option("--env", p.environments, "environments")->required();
  pictures->add_option("-o,--output", p.folder, "folder for PNG pictures")->required();
  pictures->add_option("--width", p.width)->check(CLI::Range(1, 4096));
  pictures->add_option("--height", p.height)->check(CLI::Range(1, 4096));
  pictures->add_option("--samples", p.samples, "paths a pixel")->check(CLI::Range(2, 1 << 20));
  pictures->add_option("--degrees", p.degrees, "between views");
  pictures->add_option("--bounces", p.bounces, "of the reference, 0: direct light")
      ->check(CLI::Range(0, 10'000));
  pictures
      ->add_option("--light-face", p.light_face,
                   "texels along a face of the reference's light; 0: as the transports'")
      ->check(CLI::Range(0, 1024));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (*curve) print_curve(table);
  if (*pictures) compare_pictures(p);
  return 0;
}

}  // namespace
}  // namespace haarlight

int main(int argc, char** argv) {
  try {
    return haarlight::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "haarlight-bench-view: {}\n", error.what());
    return 1;
  }
}
