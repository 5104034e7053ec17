// Puts simple surfaces together into a scene.

#include "data_gen/mesh_builder.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace haarlight::data_gen {
namespace {

bool is_zero(const Vec3& v) { return dot(v, v) == 0; }

}  // namespace

std::uint32_t MeshBuilder::add_material(const std::string& name, const Rgb& albedo,
                                        const Rgb& specular, float exponent) {
  Material material;
  material.name = name;
  material.albedo = albedo;
  material.specular = specular;
  material.exponent = exponent;
  return add_material(material);
}

std::uint32_t MeshBuilder::add_material(const Material& material) {
  scene_.material.push_back(material);
  return static_cast<std::uint32_t>(scene_.material.size() - 1);
}

int MeshBuilder::add_texture(const Image& picture, const std::vector<float>& alpha) {
  scene_.texture.push_back(picture);
  scene_.alpha.push_back(alpha);
  return static_cast<int>(scene_.texture.size()) - 1;
}

std::uint32_t MeshBuilder::add_vertex(const Vec3& position, const Vec3& normal,
                                      const std::array<float, 2>& uv) {
  scene_.position.push_back(position);
  scene_.normal.push_back(normal);
  scene_.uv.push_back(uv);
  return static_cast<std::uint32_t>(scene_.position.size() - 1);
}

void MeshBuilder::add_grid(std::uint32_t material, int columns, int rows,
                           const std::function<Vec3(double s, double t)>& surface, bool close_s) {
  const auto at = [columns](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(columns + 1) +
           static_cast<std::size_t>(i);
  };
  std::vector<Vec3> point(at(columns, rows) + 1), normal(point.size());
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      // Both ends of a closed grid must be the same point to the bit, or it has a slit.
      const double s = close_s && i == columns ? 0.0 : static_cast<double>(i) / columns;
      point[at(i, j)] = surface(s, static_cast<double>(j) / rows);
    }
  }

  // Area-weighted normals; a triangle with two equal corners (a pole, a tip) is left out.
  std::vector<std::array<std::size_t, 3>> triangles;
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    const Vec3 area = cross(point[b] - point[a], point[c] - point[a]);
    if (is_zero(area)) return;
    for (const std::size_t corner : {a, b, c}) normal[corner] = normal[corner] + area;
    triangles.push_back({a, b, c});
  };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      add(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      add(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  if (close_s) {
    for (int j = 0; j <= rows; ++j) {
      const Vec3 sum = normal[at(0, j)] + normal[at(columns, j)];
      normal[at(0, j)] = normal[at(columns, j)] = sum;
    }
  }
  // A row that is one point (a pole) shares one normal.
  for (const int j : {0, rows}) {
    if (!(point[at(0, j)] == point[at(1, j)])) continue;
    Vec3 sum;
    for (int i = 0; i <= columns; ++i) sum = sum + normal[at(i, j)];
    for (int i = 0; i <= columns; ++i) normal[at(i, j)] = sum;
  }

  // Only corners that a triangle uses are written.
  std::vector<std::int64_t> written(point.size(), -1);
  for (const auto& corners : triangles) {
    Triangle triangle;
    triangle.material = material;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t corner = corners[k];
      if (written[corner] < 0) {
        written[corner] = add_vertex(point[corner], normalize(normal[corner]));
      }
      triangle.vertex[k] = static_cast<std::uint32_t>(written[corner]);
    }
    scene_.triangle.push_back(triangle);
  }
}

void MeshBuilder::add_quad(std::uint32_t material, const Vec3& a, const Vec3& b, const Vec3& c,
                           const Vec3& d, const std::array<float, 2>& repeats) {
  const Vec3 normal = normalize(cross(b - a, d - a));
  const std::uint32_t ia = add_vertex(a, normal), ib = add_vertex(b, normal, {repeats[0], 0}),
                      ic = add_vertex(c, normal, repeats),
                      id = add_vertex(d, normal, {0, repeats[1]});
  scene_.triangle.push_back({{ia, ib, ic}, material});
  scene_.triangle.push_back({{ia, ic, id}, material});
}

void MeshBuilder::add_ground(std::uint32_t material, double half, float repeats) {
  add_quad(material, {-half, 0, half}, {half, 0, half}, {half, 0, -half}, {-half, 0, -half},
           {repeats, repeats});
}

void MeshBuilder::add_box(std::uint32_t material, const Vec3& base, const Vec3& size,
                          double radians) {
  const Rotation turn = rotation_y(radians);
  const auto corner = [&](double x, double y, double z) {
    return base + turn * Vec3{x * size.x / 2, y * size.y, z * size.z / 2};
  };
  const Vec3 a = corner(-1, 0, 1), b = corner(1, 0, 1), c = corner(1, 0, -1), d = corner(-1, 0, -1);
  const Vec3 e = corner(-1, 1, 1), f = corner(1, 1, 1), g = corner(1, 1, -1), h = corner(-1, 1, -1);
  add_quad(material, a, b, f, e);
  add_quad(material, b, c, g, f);
  add_quad(material, c, d, h, g);
  add_quad(material, d, a, e, h);
  add_quad(material, e, f, g, h);
  add_quad(material, d, c, b, a);
}

void MeshBuilder::add_ellipsoid(std::uint32_t material, const Vec3& center, const Vec3& radii,
                                int segments) {
  add_grid(
      material, segments, segments / 2,
      [&](double s, double t) {
        const double around = 2 * kPi * s;
        // The poles must be one point to the bit.
        const double ring = t == 0 || t == 1 ? 0.0 : std::sin(kPi * t);
        const double height = t == 0 ? -1.0 : t == 1 ? 1.0 : -std::cos(kPi * t);
        return center + Vec3{radii.x * ring * std::sin(around), radii.y * height,
                             radii.z * ring * std::cos(around)};
      },
      true);
}

void MeshBuilder::add_tube(std::uint32_t material, std::span<const Vec3> path,
                           std::span<const double> radii, int sides) {
  // A frame carried along the path by the least turn, so that the tube does not twist.
  const std::size_t count = path.size();
  std::vector<Vec3> side(count), other(count);
  Vec3 carried = std::abs(normalize(path[1] - path[0]).y) < 0.9 ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 along = normalize(path[std::min(i + 1, count - 1)] - path[i == 0 ? 0 : i - 1]);
    carried = normalize(carried - along * dot(carried, along));
    side[i] = carried;
    other[i] = cross(along, carried);
  }
  add_grid(
      material, sides, static_cast<int>(count) - 1,
      [&](double s, double t) {
        const auto i = static_cast<std::size_t>(std::lround(t * static_cast<double>(count - 1)));
        const double around = 2 * kPi * s;
        return path[i] + (side[i] * std::cos(around) + other[i] * std::sin(around)) * radii[i];
      },
      true);
}

void MeshBuilder::add_lathe(std::uint32_t material, const Vec3& base,
                            std::span<const ProfilePoint> profile, int segments) {
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const ProfilePoint &low = profile[i], &high = profile[i + 1];
    add_grid(
        material, segments, 1,
        [&](double s, double t) {
          const ProfilePoint& p = t == 0 ? low : high;
          const double around = 2 * kPi * s;
          return base + Vec3{p.radius * std::sin(around), p.height, p.radius * std::cos(around)};
        },
        true);
  }
}

Scene MeshBuilder::finish(const Camera& camera) {
  scene_.camera = camera;
  return std::exchange(scene_, Scene{});
}

}  // namespace haarlight::data_gen
