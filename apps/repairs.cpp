// Prints the reports of importers.

#include "apps/repairs.h"

#include <fmt/format.h>

#include <cstdio>

namespace haarlight {
namespace {

void print_count(const std::filesystem::path& file, std::int64_t count, const char* what) {
  if (count > 0) fmt::print(stderr, "{}: {} {}\n", file.string(), count, what);
}

}  // namespace

void print_repairs(const std::filesystem::path& file, const EnvironmentReport& report) {
  if (report.negative_pixels > 0) {
    fmt::print(stderr, "{}: {} pixels with negative radiance (down to {:.4g}) set to 0\n",
               file.string(), report.negative_pixels, report.smallest);
  }
  print_count(file, report.not_finite_pixels, "pixels that are not finite set to 0");
}

void print_repairs(const std::filesystem::path& file, const SceneReport& report) {
  print_count(file, report.dropped_degenerate, "triangles without area dropped");
  print_count(file, report.dropped_not_finite,
              "triangles with a corner that is not finite or beyond 1e37 dropped");
  print_count(file, report.dropped_duplicate, "repeated triangles dropped");
  print_count(file, report.dropped_out_of_range,
              "triangles that name vertices that are not there dropped");
  print_count(file, report.dropped_not_triangle, "points and lines left out");
  print_count(file, report.against_normals,
              "triangles wound against their normals, the normals decide");
  print_count(file, report.tiny, "triangles too small beside the whole scene to be told apart");
  print_count(file, report.unused_vertices, "unused vertices left out");
  print_count(file, report.normals_made, "vertex normals made");
  print_count(file, report.textures_missing, "textures not found, plain colours used");
  print_count(file, report.blended_materials, "blended materials taken as holes or thin walls");
  print_count(file, report.rough_glass, "materials of rough glass taken as smooth glass");
  print_count(file, report.measured_textures,
              "base colour textures left out of measured materials: the colour is the table's");
  print_count(file, report.energy_scaled, "materials that reflect more than all light scaled down");
}

void print_notes(const std::filesystem::path& file, const std::vector<std::string>& notes) {
  for (const std::string& note : notes) fmt::print(stderr, "{}: {}\n", file.string(), note);
}

}  // namespace haarlight
