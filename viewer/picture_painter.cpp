// The picture's shader: background where the scene is not, exposure, curve, sRGB.

#include "viewer/picture_painter.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "core/error.h"
#include "viewer/settings.h"

namespace haarlight::viewer {
namespace {

constexpr int kMostDiscs = kMaxDiscs + 1;  // that of the motion too

// One triangle over the whole rectangle.
constexpr const char* kVertexShader = R"(#version 330 core
out vec2 place;
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  place = vec2(0.5 + 0.5 * corner.x, 0.5 - 0.5 * corner.y);
  gl_Position = vec4(corner, 0.0, 1.0);
}
)";

// The curves are those of prt/tonemap.cpp, the background that of prt/motion_background.cpp.
constexpr const char* kFragmentShader = R"(#version 330 core
in vec2 place;
out vec4 colour;
uniform sampler2D picture, reference, coverage, env_from, env_to, ramp;
uniform bool has_reference, has_to;
uniform float split;
uniform mat3 camera, light_to_environment;
uniform vec2 camera_reach;
uniform float blend, background, exposure;
uniform int curve;
uniform int discs;
uniform vec4 disc_place[9];
uniform vec3 disc_radiance[9];

vec3 look_up(sampler2D map, vec3 d) {
  return texture(map, vec2(0.5 + atan(d.x, -d.z) / 6.28318530718,
                           acos(clamp(d.y, -1.0, 1.0)) / 3.14159265359)).rgb;
}

void main() {
  vec3 light = has_reference && place.x >= split ? texture(reference, place).rgb
                                                 : texture(picture, place).rgb;
  float open = 1.0 - texture(coverage, place).r;
  if (open > 0.0) {
    vec3 d = normalize(camera * vec3((2.0 * place.x - 1.0) * camera_reach.x,
                                     (1.0 - 2.0 * place.y) * camera_reach.y, -1.0));
    vec3 e = light_to_environment * d;
    vec3 behind = blend < 1.0 ? (1.0 - blend) * look_up(env_from, e) : vec3(0.0);
    if (blend > 0.0 && has_to) behind += blend * look_up(env_to, e);
    behind *= background;
    for (int i = 0; i < discs; ++i) {
      float away = dot(d, disc_place[i].xyz) - disc_place[i].w;
      behind += disc_radiance[i] * clamp(away / max(fwidth(away), 1e-6) + 0.5, 0.0, 1.0);
    }
    light += open * behind;
  }
  vec3 x = min(max(light * exposure, 0.0), 1e6);
  if (curve == 1) {
    x /= 1.0 + dot(x, vec3(0.2126, 0.7152, 0.0722));
  } else if (curve == 2) {
    x = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
  } else if (curve == 3) {
    float y = dot(x, vec3(0.2126, 0.7152, 0.0722));
    x = y > 0.0 ? texture(ramp, vec2((log2(y / 0.18) + 5.0) / 10.0, 0.5)).rgb : vec3(0.0);
  }
  x = clamp(x, 0.0, 1.0);
  colour = vec4(mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x)), 1.0);
}
)";

unsigned compile(unsigned kind, const char* source) {
  const unsigned shader = glCreateShader(kind);
  glShaderSource(shader, 1, &source, nullptr);
  glCompileShader(shader);
  int good = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (!good) {
    std::array<char, 512> log{};
    glGetShaderInfoLog(shader, static_cast<int>(log.size()), nullptr, log.data());
    throw Error(ErrorKind::missing,
                fmt::format("OpenGL does not compile the picture's shader: {}", log.data()));
  }
  return shader;
}

void bind(int unit, const Texture& texture) {
  glActiveTexture(static_cast<unsigned>(GL_TEXTURE0 + unit));
  glBindTexture(GL_TEXTURE_2D, texture.id());
}

void set_matrix(int at, const Rotation& m) {
  std::array<float, 9> rows{};
  for (std::size_t i = 0; i < 3; ++i) {
    rows[3 * i] = static_cast<float>(m.row[i].x);
    rows[3 * i + 1] = static_cast<float>(m.row[i].y);
    rows[3 * i + 2] = static_cast<float>(m.row[i].z);
  }
  glUniformMatrix3fv(at, 1, GL_TRUE, rows.data());
}

}  // namespace

struct PicturePainter::Uniforms {
  int has_reference, has_to, split, camera, light_to_environment, camera_reach, blend, background,
      exposure, curve, discs, disc_place, disc_radiance;
};

PicturePainter::PicturePainter() : at_(std::make_unique<Uniforms>()) {
  const unsigned vertex = compile(GL_VERTEX_SHADER, kVertexShader);
  const unsigned fragment = compile(GL_FRAGMENT_SHADER, kFragmentShader);
  program_ = glCreateProgram();
  glAttachShader(program_, vertex);
  glAttachShader(program_, fragment);
  glLinkProgram(program_);
  glDeleteShader(vertex);
  glDeleteShader(fragment);
  glGenVertexArrays(1, &vertices_);
  const auto find = [&](const char* name) { return glGetUniformLocation(program_, name); };
  *at_ = {find("has_reference"),
          find("has_to"),
          find("split"),
          find("camera"),
          find("light_to_environment"),
          find("camera_reach"),
          find("blend"),
          find("background"),
          find("exposure"),
          find("curve"),
          find("discs"),
          find("disc_place"),
          find("disc_radiance")};
  glUseProgram(program_);
  int unit = 0;
  for (const char* name : {"picture", "reference", "coverage", "env_from", "env_to", "ramp"}) {
    glUniform1i(find(name), unit++);
  }
  Image ramp(256, 1);
  for (int i = 0; i < 256; ++i) {
    ramp.at(i, 0) = false_colour_of(((i + 0.5) / 128 - 1) * kFalseColourStops);
  }
  ramp_.fill(ramp);
}

PicturePainter::~PicturePainter() {
  glDeleteProgram(program_);
  glDeleteVertexArrays(1, &vertices_);
}

void PicturePainter::upload(const ViewFrame& frame) {
  if (frame.number == 0) return;
  picture_.fill(frame.picture);
  compared_ = frame.compared;
  if (compared_) reference_.fill(frame.reference);
  if (frame.view_number != view_) {
    view_ = frame.view_number;
    coverage_.fill(frame.picture.width, frame.picture.height, frame.coverage);
  }
  if (frame.from != light_from_) {
    light_from_ = frame.from;
    from_.fill(light_from_->preview);
    from_.wrap_around();
  }
  if (frame.to && frame.to != light_to_) {
    light_to_ = frame.to;
    to_.fill(light_to_->preview);
    to_.wrap_around();
  }
  light_ = frame.light;
  camera_ = frame.camera;
}

void PicturePainter::draw(const PixelRect& where, int height, const PaintOptions& options) {
  if (picture_.empty() || where.width < 1 || where.height < 1) return;
  glViewport(where.x, height - where.y - where.height, where.width, where.height);
  glDisable(GL_BLEND);
  glDisable(GL_SCISSOR_TEST);
  glUseProgram(program_);
  int unit = 0;
  for (const Texture* texture : {&picture_, &reference_, &coverage_, &from_, &to_, &ramp_}) {
    bind(unit++, *texture);
  }
  glActiveTexture(GL_TEXTURE0);
  glUniform1i(at_->has_reference, options.reference && compared_);
  glUniform1i(at_->has_to, !to_.empty());
  glUniform1f(at_->split, static_cast<float>(options.split));
  set_matrix(at_->camera, camera_.orientation);
  set_matrix(at_->light_to_environment, light_.rotation.transposed());
  const double half = std::tan(0.5 * camera_.vertical_fov);
  glUniform2f(at_->camera_reach, static_cast<float>(half * camera_.width / camera_.height),
              static_cast<float>(half));
  glUniform1f(at_->blend, static_cast<float>(light_.blend));
  glUniform1f(at_->background, static_cast<float>(light_.background));
  glUniform1f(at_->exposure, static_cast<float>(std::exp2(options.exposure_ev)));
  glUniform1i(at_->curve, options.false_colour ? 3 : static_cast<int>(options.curve));
  std::array<float, 4 * kMostDiscs> place{};
  std::array<float, 3 * kMostDiscs> radiance{};
  const std::size_t discs = std::min<std::size_t>(light_.discs.size(), kMostDiscs);
  for (std::size_t i = 0; i < discs; ++i) {
    const DiscLight& disc = light_.discs[i];
    place[4 * i] = static_cast<float>(disc.direction.x);
    place[4 * i + 1] = static_cast<float>(disc.direction.y);
    place[4 * i + 2] = static_cast<float>(disc.direction.z);
    place[4 * i + 3] = static_cast<float>(std::cos(disc.half_angle));
    radiance[3 * i] = disc.radiance.r;
    radiance[3 * i + 1] = disc.radiance.g;
    radiance[3 * i + 2] = disc.radiance.b;
  }
  glUniform1i(at_->discs, static_cast<int>(discs));
  glUniform4fv(at_->disc_place, kMostDiscs, place.data());
  glUniform3fv(at_->disc_radiance, kMostDiscs, radiance.data());
  glBindVertexArray(vertices_);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace haarlight::viewer
