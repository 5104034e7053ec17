// Pictures of a scene file, in it or beside it, into the scene; each read once.

#include "precompute/texture_import.h"

#include <assimp/scene.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "core/error.h"
#include "precompute/texture.h"

namespace haarlight {
namespace {

float unit(float value) { return value > 0 ? std::min(value, 1.0f) : 0.0f; }  // NaN becomes 0

float srgb_to_linear(float c) {
  return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}

// Plain 8-bit texels.
Image texels(const aiTexture& texture, ImageEncoding encoding) {
  Image image(static_cast<int>(texture.mWidth), static_cast<int>(texture.mHeight));
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const aiTexel& t = texture.pcData[i];
    const auto value = [encoding](unsigned char c) {
      const float v = static_cast<float>(c) / 255.0f;
      return encoding == ImageEncoding::color ? srgb_to_linear(v) : v;
    };
    image.pixels[i] = {value(t.r), value(t.g), value(t.b)};
  }
  return image;
}

std::vector<float> texel_alphas(const aiTexture& texture) {
  std::vector<float> alpha(std::size_t{texture.mWidth} * texture.mHeight);
  for (std::size_t i = 0; i < alpha.size(); ++i) {
    alpha[i] = static_cast<float>(texture.pcData[i].a) / 255.0f;
  }
  return alpha;
}

// A picture inside the scene file, as a file of its own for as long as it is needed.
class TemporaryPicture {
 public:
  explicit TemporaryPicture(const aiTexture& texture) {
    std::string suffix = ".";
    suffix += texture.achFormatHint[0] != '\0' ? texture.achFormatHint : "png";
    name_ =
        (std::filesystem::temp_directory_path() / ("haarlight-texture-XXXXXX" + suffix)).string();
    const int descriptor = mkstemps(name_.data(), static_cast<int>(suffix.size()));
    if (descriptor < 0) {
      throw Error(ErrorKind::io, fmt::format("{}: cannot be created to decode a texture", name_));
    }
    close(descriptor);
    std::ofstream out(name_, std::ios::binary);
    out.write(reinterpret_cast<const char*>(texture.pcData),
              static_cast<std::streamsize>(texture.mWidth));
    out.close();
    if (!out) {
      remove();
      throw Error(ErrorKind::io, fmt::format("{}: cannot be written to decode a texture", name_));
    }
  }
  ~TemporaryPicture() { remove(); }
  TemporaryPicture(const TemporaryPicture&) = delete;
  TemporaryPicture& operator=(const TemporaryPicture&) = delete;
  const std::string& name() const { return name_; }

 private:
  void remove() const {
    std::error_code ignored;
    std::filesystem::remove(name_, ignored);
  }
  std::string name_;
};

std::string with_slashes(std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');  // as files from Windows have it
  return name;
}

}  // namespace

Image TextureImport::load(const std::string& path, ImageEncoding encoding) const {
  const aiTexture* embedded = file_.GetEmbeddedTexture(path.c_str());
  if (!embedded) return load_image(folder_ / with_slashes(path), encoding);
  if (embedded->mHeight != 0) return texels(*embedded, encoding);
  return load_image(TemporaryPicture(*embedded).name(), encoding);
}

std::vector<float> TextureImport::alpha(const std::string& path) const {
  const aiTexture* embedded = file_.GetEmbeddedTexture(path.c_str());
  if (!embedded) return load_alpha(folder_ / with_slashes(path));
  if (embedded->mHeight != 0) return texel_alphas(*embedded);
  return load_alpha(TemporaryPicture(*embedded).name());
}

int TextureImport::add(Image image) {
  for (Rgb& p : image.pixels) p = {unit(p.r), unit(p.g), unit(p.b)};
  scene_.texture.push_back(std::move(image));
  if (!scene_.alpha.empty()) scene_.alpha.emplace_back();
  return static_cast<int>(scene_.texture.size()) - 1;
}

int TextureImport::index(const std::string& path, ImageEncoding encoding) {
  if (path.empty()) return -1;
  const auto [at, is_new] = plain_.try_emplace({path, encoding}, -1);
  if (!is_new) return at->second;
  try {
    at->second = add(load(path, encoding));
  } catch (const Error&) {
    ++scene_.report.textures_missing;
  }
  return at->second;
}

bool TextureImport::has_alpha(int index) const {
  const auto i = static_cast<std::size_t>(index);
  return index >= 0 && i < scene_.alpha.size() && !scene_.alpha[i].empty();
}

int TextureImport::index_with_alpha(const std::string& path, const std::string& mask) {
  const auto [at, is_new] = with_alpha_.try_emplace({path, mask}, -1);
  if (!is_new) return at->second;
  const int plain = index(path, ImageEncoding::color);
  at->second = plain;
  const std::string& from = mask.empty() ? path : mask;
  if (from.empty() || (plain < 0 && mask.empty())) return plain;
  std::vector<float> values;
  int width = 0, height = 0;
  try {
    values = alpha(from);
    if (!mask.empty()) {
      const Image picture = load(mask, ImageEncoding::data);
      width = picture.width, height = picture.height;
      if (values.empty()) {
        for (const Rgb& p : picture.pixels) values.push_back(p.r);
      }
    }
  } catch (const Error&) {
    ++scene_.report.textures_missing;
    return plain;
  }
  for (float& v : values) v = unit(v);
  if (std::all_of(values.begin(), values.end(), [](float v) { return v >= 1; })) {
    return plain;
  }
  // One that others use without this mask stays as it is.
  if (plain < 0) {
    Image white(width, height);
    std::fill(white.pixels.begin(), white.pixels.end(), Rgb{1, 1, 1});
    at->second = add(std::move(white));
  } else if (!mask.empty()) {
    at->second = add(scene_.texture[static_cast<std::size_t>(plain)]);
  }
  const Image& image = scene_.texture[static_cast<std::size_t>(at->second)];
  if (!mask.empty() && (width != image.width || height != image.height)) {
    std::vector<float> fitted;
    fitted.reserve(image.pixels.size());
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        fitted.push_back(sample_texture(values, width, height, (x + 0.5) / image.width,
                                        1 - (y + 0.5) / image.height));
      }
    }
    values = std::move(fitted);
  }
  scene_.alpha.resize(scene_.texture.size());
  scene_.alpha[static_cast<std::size_t>(at->second)] = std::move(values);
  return at->second;
}

}  // namespace haarlight
