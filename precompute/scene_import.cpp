// Scenes from files: glTF, GLB, OBJ and PLY.

#include "precompute/scene_import.h"

#include <assimp/BaseImporter.h>
#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/material.h>
#include <assimp/mesh.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "core/error.h"
#include "precompute/gltf_extras.h"
#include "precompute/material_import.h"
#include "precompute/plain_ply.h"
#include "precompute/polygon.h"
#include "precompute/scene_clean.h"
#include "precompute/texture_import.h"

namespace haarlight {
namespace {

enum class FileType { gltf, obj, ply, other };

FileType file_type(const std::filesystem::path& file) {
  std::string suffix = file.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (suffix == ".gltf" || suffix == ".glb") return FileType::gltf;
  if (suffix == ".obj") return FileType::obj;
  if (suffix == ".ply") return FileType::ply;
  return FileType::other;
}

// assimp's reason as part of a one-line message.
std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text.empty() ? "no reason given" : text;
}

// Leaves the readers of one suffix. Left to itself assimp lets each of its fifty have a go at a
// file that no reader of its suffix wants, and some of them do not bear damaged bytes.
void keep_readers_of(const std::string& suffix, Assimp::Importer& importer) {
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    std::set<std::string> suffixes;
    importer.GetImporter(i)->GetExtensionList(suffixes);
    if (suffixes.contains(suffix)) continue;
    const std::unique_ptr<Assimp::BaseImporter> left_out(importer.GetImporter(i));
    importer.UnregisterLoader(left_out.get());
  }
}

// Files as they are, but for one whose bytes are others. They must outlive it.
class InPlaceOf : public Assimp::DefaultIOSystem {
 public:
  InPlaceOf(std::string file, const std::string& bytes) : file_(std::move(file)), bytes_(bytes) {}
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (file != file_) return DefaultIOSystem::Open(file, mode);
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(bytes_.data()),
                                      bytes_.size());
  }

 private:
  std::string file_;
  const std::string& bytes_;
};

float unit(float value) { return value > 0 ? std::min(value, 1.0f) : 0.0f; }  // NaN becomes 0
template <typename Color>
Rgb unit_rgb(const Color& c) {
  return {unit(c.r), unit(c.g), unit(c.b)};
}

float srgb_to_linear(float c) {
  return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}

// ---- materials ----------------------------------------------------------------------------------

void add_materials(const aiScene& file, FileType type, const std::vector<GltfMaterial>& numbers,
                   const std::filesystem::path& folder, Scene& scene) {
  TextureImport textures(file, folder, scene);
  for (unsigned m = 0; m < file.mNumMaterials; ++m) {
    const aiMaterial& in = *file.mMaterials[m];
    const std::string name = in.GetName().C_Str();
    Material out;
    const bool is_default = type == FileType::gltf ? m >= numbers.size()
                            : type == FileType::ply
                                ? name.empty()
                                : name.empty() || name == AI_DEFAULT_MATERIAL_NAME;
    if (is_default) {
      if (!scene.tint.empty()) out.albedo = {1, 1, 1};  // the colour is in the vertices
      out.name = "default";
    } else {
      out = type == FileType::gltf
                ? import_gltf_material(numbers[m], in, textures, scene, scene.report)
                : import_obj_material(in, textures, scene, scene.report);
      out.name = name;
    }
    scene.material.push_back(out);
    if (!is_default && type == FileType::gltf && !numbers[m].measured.empty()) {
      set_measured(scene, scene.material.size() - 1, folder / numbers[m].measured);
    }
  }
}

// ---- meshes -------------------------------------------------------------------------------------

Vec3 vec(const aiVector3D& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

// A node's transform in double.
struct Transform {
  Vec3 row[3];
  Vec3 move;

  explicit Transform(const aiMatrix4x4& m)
      : row{vec({m.a1, m.a2, m.a3}), vec({m.b1, m.b2, m.b3}), vec({m.c1, m.c2, m.c3})},
        move(vec({m.a4, m.b4, m.c4})) {}
  Transform() : Transform(aiMatrix4x4()) {}

  Vec3 direction(const Vec3& v) const { return {dot(row[0], v), dot(row[1], v), dot(row[2], v)}; }
  Vec3 point(const Vec3& v) const { return direction(v) + move; }
  double determinant() const { return dot(row[0], cross(row[1], row[2])); }
  // By the cofactors: the inverse transposed up to a factor, which the caller divides out.
  Vec3 normal(const Vec3& v) const {
    const double sign = determinant() < 0 ? -1 : 1;
    return sign * Vec3{dot(cross(row[1], row[2]), v), dot(cross(row[2], row[0]), v),
                       dot(cross(row[0], row[1]), v)};
  }
  Transform operator*(const Transform& first) const {
    Transform t;
    const Vec3 column[3] = {{first.row[0].x, first.row[1].x, first.row[2].x},
                            {first.row[0].y, first.row[1].y, first.row[2].y},
                            {first.row[0].z, first.row[1].z, first.row[2].z}};
    for (int i = 0; i < 3; ++i) {
      t.row[i] = {dot(row[i], column[0]), dot(row[i], column[1]), dot(row[i], column[2])};
    }
    t.move = point(first.move);
    return t;
  }
};

void add_vertices(const aiMesh& mesh, const Transform& transform, FileType type, Scene& scene) {
  const std::size_t before = scene.position.size();
  const std::size_t count = mesh.mNumVertices;
  if (before + count > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorKind::format,
                fmt::format("{}: {} vertices, expected below 2^32", scene.name, before + count));
  }
  if (mesh.HasTextureCoords(1) && scene.uv2.empty()) scene.uv2.resize(before);
  const bool tinted = mesh.HasVertexColors(0);
  if (tinted && scene.tint.empty()) scene.tint.assign(before, Rgb{1, 1, 1});
  for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
    scene.position.push_back(transform.point(vec(mesh.mVertices[v])));
    Vec3 normal;  // zero: to be made
    if (mesh.HasNormals()) {
      normal = transform.normal(vec(mesh.mNormals[v]));
      const double size = length(normal);
      normal = size > 0 && std::isfinite(size) ? normal * (1 / size) : Vec3{};
    }
    scene.normal.push_back(normal);
    std::array<float, 2> uv{};
    if (mesh.HasTextureCoords(0)) {
      uv = {mesh.mTextureCoords[0][v].x, mesh.mTextureCoords[0][v].y};
    }
    scene.uv.push_back(uv);
    if (mesh.HasTextureCoords(1)) {
      scene.uv2.push_back({mesh.mTextureCoords[1][v].x, mesh.mTextureCoords[1][v].y});
    } else if (!scene.uv2.empty()) {
      scene.uv2.push_back({});
    }
    if (tinted) {
      Rgb tint = unit_rgb(mesh.mColors[0][v]);
      if (type == FileType::ply) {
        tint = {srgb_to_linear(tint.r), srgb_to_linear(tint.g), srgb_to_linear(tint.b)};
      }
      scene.tint.push_back(tint);
    } else if (!scene.tint.empty()) {
      scene.tint.push_back({1, 1, 1});
    }
  }
}

void add_mesh(const aiMesh& mesh, const Transform& transform, FileType type, Scene& scene) {
  const auto first = static_cast<std::uint32_t>(scene.position.size());
  add_vertices(mesh, transform, type, scene);
  const bool mirrored = transform.determinant() < 0;
  std::vector<Vec3> corners;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    corners.clear();
    for (unsigned c = 0; c < face.mNumIndices; ++c) {
      if (face.mIndices[c] >= mesh.mNumVertices) {
        throw Error(ErrorKind::format,
                    fmt::format("{}: face {} names vertex {}, expected below {}", scene.name, f,
                                face.mIndices[c], mesh.mNumVertices));
      }
      corners.push_back(scene.position[first + face.mIndices[c]]);
    }
    if (corners.size() < 3) {
      ++scene.report.dropped_not_triangle;
      continue;
    }
    for (const auto& t : triangulate(corners)) {
      Triangle triangle;
      triangle.material = mesh.mMaterialIndex;
      for (std::size_t c = 0; c < 3; ++c) {
        triangle.vertex[mirrored ? 2 - c : c] = first + face.mIndices[t[c]];
      }
      scene.triangle.push_back(triangle);
    }
  }
}

// So that large scenes are not copied as they grow; nodes that share a mesh grow it still.
void reserve_vertices(const aiScene& file, Scene& scene) {
  std::size_t vertices = 0, faces = 0;
  for (unsigned m = 0; m < file.mNumMeshes; ++m) {
    vertices += file.mMeshes[m]->mNumVertices;
    faces += file.mMeshes[m]->mNumFaces;
  }
  scene.position.reserve(vertices);
  scene.normal.reserve(vertices);
  scene.uv.reserve(vertices);
  scene.triangle.reserve(faces);
}

// Triangles that a glTF file promises and its reader has not made.
std::int64_t left_out(const aiScene& file, std::int64_t promised) {
  std::int64_t found = 0;
  for (unsigned m = 0; m < file.mNumMeshes; ++m) {
    const aiMesh& mesh = *file.mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) found += mesh.mFaces[f].mNumIndices == 3;
  }
  return std::max<std::int64_t>(promised - found, 0);
}

void add_nodes(const aiScene& file, FileType type, Scene& scene) {
  struct Visit {
    const aiNode* node;
    Transform above;
  };
  std::vector<Visit> todo{{file.mRootNode, Transform()}};
  while (!todo.empty()) {
    const Visit here = todo.back();
    todo.pop_back();
    const Transform transform = here.above * Transform(here.node->mTransformation);
    for (unsigned i = 0; i < here.node->mNumMeshes; ++i) {
      add_mesh(*file.mMeshes[here.node->mMeshes[i]], transform, type, scene);
    }
    for (unsigned i = here.node->mNumChildren; i > 0; --i) {
      todo.push_back({here.node->mChildren[i - 1], transform});
    }
  }
}

}  // namespace

Scene import_scene(const std::filesystem::path& file) {
  std::error_code code;
  if (!std::filesystem::exists(file, code)) {
    throw Error(ErrorKind::missing, fmt::format("{}: no such file, expected a glTF, OBJ or PLY "
                                                "scene",
                                                file.string()));
  }
  if (!std::filesystem::is_regular_file(file, code)) {
    throw Error(ErrorKind::format,
                fmt::format("{}: not a file, expected a glTF, OBJ or PLY scene", file.string()));
  }
  const FileType type = file_type(file);
  if (type == FileType::other) {
    throw Error(ErrorKind::format, fmt::format("{}: suffix is \"{}\", expected .gltf, .glb, .obj "
                                               "or .ply",
                                               file.string(), file.extension().string()));
  }
  GltfExtras extras;
  if (type == FileType::gltf) extras = read_gltf_extras(file);
  // No post-processing: what it drops or alters it does not say.
  Assimp::Importer importer;
  keep_readers_of(type == FileType::gltf  ? "gltf"
                  : type == FileType::obj ? "obj"
                                          : "ply",
                  importer);
  // What the reader would fall over is left out before it sees it.
  if (type == FileType::ply) extras.still = plain_ply(file);
  if (!extras.still.empty()) importer.SetIOHandler(new InPlaceOf(file.string(), extras.still));
  const aiScene* read = importer.ReadFile(file.string(), 0);
  if (!read || !read->mRootNode) {
    throw Error(ErrorKind::format, fmt::format("{}: cannot be read as a scene ({}), expected a "
                                               "glTF, OBJ or PLY file",
                                               file.string(), one_line(importer.GetErrorString())));
  }

  Scene scene;
  scene.name = file.filename().string();
  reserve_vertices(*read, scene);
  if (type == FileType::gltf) scene.report.dropped_out_of_range = left_out(*read, extras.triangles);
  add_nodes(*read, type, scene);
  add_materials(*read, type, extras.material, file.parent_path(), scene);
  importer.FreeScene();  // cleaning a large scene wants the room
  scene.camera = extras.camera;
  clean_scene(scene);
  return scene;
}

}  // namespace haarlight
