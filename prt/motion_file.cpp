// Recorded motions to and from JSON.

#include "prt/motion_file.h"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json_depth.h"

namespace haarlight {
namespace {

using nlohmann::json;

constexpr std::string_view kFormat = "haarlight-motion";
constexpr int kVersion = 1;
constexpr std::size_t kMaxFrames = 1'000'000;
constexpr std::size_t kMaxBytes = std::size_t{1} << 30;

constexpr std::pair<FrameStart, const char*> kStarts[] = {
    {FrameStart::advance, "advance"}, {FrameStart::exact, "exact"}, {FrameStart::dark, "dark"}};

[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw Error(ErrorKind::format, fmt::format("{}: {}", where, what));
}

double number(const json& value, const std::string& where) {
  if (!value.is_number()) refuse(where, "is " + value.dump() + ", expected a number");
  return value.get<double>();
}

int integer(const json& value, const std::string& where) {
  if (!value.is_number_integer() || value < 0 || value > 1'000'000'000) {
    refuse(where, "is " + value.dump() + ", expected a whole number from 0 on");
  }
  return value.get<int>();
}

std::string word(const json& value, const std::string& where) {
  if (!value.is_string()) refuse(where, "is " + value.dump() + ", expected a word");
  return value.get<std::string>();
}

template <std::size_t n>
std::array<double, n> numbers(const json& value, const std::string& where) {
  if (!value.is_array() || value.size() != n) {
    refuse(where, fmt::format("has {} entries, expected {}",
                              value.is_array() ? value.size() : std::size_t{1}, n));
  }
  std::array<double, n> out;
  for (std::size_t i = 0; i < n; ++i) out[i] = number(value[i], where);
  return out;
}

DiscLight disc_from(const json& value, const std::string& where) {
  DiscLight disc;
  if (!value.is_object()) refuse(where, "is " + value.dump() + ", expected an object");
  for (const auto& [key, entry] : value.items()) {
    const std::string at = where + ", " + key;
    if (key == "direction") {
      const auto d = numbers<3>(entry, at);
      disc.direction = {d[0], d[1], d[2]};
    } else if (key == "half_angle") {
      disc.half_angle = number(entry, at);
    } else if (key == "radiance") {
      const auto c = numbers<3>(entry, at);
      disc.radiance = Rgb(RgbD(c[0], c[1], c[2]));
    } else {
      refuse(at, "is no key of a light, expected direction, half_angle or radiance");
    }
  }
  return disc;
}

Rotation rotation_of(const std::array<double, 9>& m) {
  Rotation rotation;
  for (std::size_t i = 0; i < 3; ++i) rotation.row[i] = {m[3 * i], m[3 * i + 1], m[3 * i + 2]};
  return rotation;
}

json rotation_json(const Rotation& rotation) {
  json m = json::array();
  for (const Vec3& row : rotation.row) {
    for (const double x : {row.x, row.y, row.z}) m.push_back(x);
  }
  return m;
}

Camera camera_from(const json& value, const std::string& where) {
  Camera camera;
  if (!value.is_object()) refuse(where, "is " + value.dump() + ", expected an object");
  for (const auto& [key, entry] : value.items()) {
    const std::string at = where + ", " + key;
    if (key == "position") {
      const auto p = numbers<3>(entry, at);
      camera.position = {p[0], p[1], p[2]};
    } else if (key == "orientation") {
      camera.orientation = rotation_of(numbers<9>(entry, at));
    } else if (key == "vertical_fov") {
      camera.vertical_fov = number(entry, at);
    } else if (key == "width") {
      camera.width = integer(entry, at);
    } else if (key == "height") {
      camera.height = integer(entry, at);
    } else {
      refuse(at, "is no key of a camera");
    }
  }
  return camera;
}

json camera_json(const Camera& camera) {
  return {{"position", {camera.position.x, camera.position.y, camera.position.z}},
          {"orientation", rotation_json(camera.orientation)},
          {"vertical_fov", camera.vertical_fov},
          {"width", camera.width},
          {"height", camera.height}};
}

FrameCourse course_from(const json& value, const std::string& at) {
  if (!value.is_object()) refuse(at, "is " + value.dump() + ", expected an object");
  FrameCourse course;
  course.timed = true;
  for (const auto& [key, entry] : value.items()) {
    const std::string inner = at + "." + key;
    if (key == "first") {
      course.first = integer(entry, inner);
    } else if (key == "put_off") {
      if (!entry.is_array()) refuse(inner, "is " + entry.dump() + ", expected a list of bands");
      for (const json& band : entry) {
        const int b = integer(band, inner);
        if (b >= HaarLayout::kMaxBands) {
          refuse(inner, fmt::format("has {}, expected bands below {}", b, HaarLayout::kMaxBands));
        }
        course.put_off[static_cast<std::size_t>(b)] = true;
      }
    } else {
      refuse(inner, "is no key of a frame under a time");
    }
  }
  return course;
}

json course_json(const FrameCourse& course) {
  json out = json::object();
  if (course.first > 0) out["first"] = course.first;
  for (std::size_t b = 0; b < course.put_off.size(); ++b) {
    if (course.put_off[b]) out["put_off"].push_back(b);
  }
  return out;
}

void read_key(const std::string& key, const json& value, const std::string& at,
              RecordedFrame& frame) {
  if (key == "from") {
    frame.light.from = integer(value, at);
  } else if (key == "to") {
    frame.light.to = integer(value, at);
  } else if (key == "blend") {
    frame.light.blend = number(value, at);
  } else if (key == "background") {
    frame.light.background = number(value, at);
  } else if (key == "rotation") {
    const auto m = numbers<9>(value, at);
    frame.light.rotation = rotation_of(m);
  } else if (key == "camera") {
    frame.camera = camera_from(value, at);
  } else if (key == "lights") {
    if (!value.is_array()) refuse(at, "is " + value.dump() + ", expected a list");
    frame.light.discs.clear();
    for (const json& entry : value) frame.light.discs.push_back(disc_from(entry, at));
  } else if (key == "method") {
    const auto method = lighting_method_from_name(word(value, at));
    if (!method) refuse(at, "is " + value.dump() + ", expected nwa, bi, pbi or reference");
    frame.method = *method;
  } else if (key == "wavelets") {
    frame.wavelets = integer(value, at);
    if (frame.wavelets < 1) refuse(at, "is 0, expected at least 1");
  } else if (key == "timed") {
    frame.course = course_from(value, at);
  } else if (key == "weight") {
    const auto weight = wavelet_weight_from_name(word(value, at));
    if (!weight) refuse(at, "is " + value.dump() + ", expected none, area or transport");
    frame.weight = *weight;
  } else if (key == "start") {
    const std::string name = word(value, at);
    for (const auto& [start, known] : kStarts) {
      if (name == known) {
        frame.start = start;
        return;
      }
    }
    refuse(at, "is " + value.dump() + ", expected advance, exact or dark");
  } else {
    refuse(at, "is no key of a frame");
  }
}

json light_json(const DiscLight& disc) {
  const RgbD c(disc.radiance);
  return {{"direction", {disc.direction.x, disc.direction.y, disc.direction.z}},
          {"half_angle", disc.half_angle},
          {"radiance", {c.r, c.g, c.b}}};
}

json frame_json(const RecordedFrame& frame, const RecordedFrame& before) {
  json out = json::object();
  const LightState& now = frame.light;
  const LightState& old = before.light;
  if (now.from != old.from) out["from"] = now.from;
  if (now.to != old.to) out["to"] = now.to;
  if (now.blend != old.blend) out["blend"] = now.blend;
  if (now.background != old.background) out["background"] = now.background;
  if (now.rotation != old.rotation) out["rotation"] = rotation_json(now.rotation);
  if (now.discs != old.discs) {
    json& lights = out["lights"] = json::array();
    for (const DiscLight& disc : now.discs) lights.push_back(light_json(disc));
  }
  if (frame.method != before.method) out["method"] = lighting_method_name(frame.method);
  if (frame.wavelets != before.wavelets) out["wavelets"] = frame.wavelets;
  if (frame.course.timed) out["timed"] = course_json(frame.course);
  if (frame.weight != before.weight) out["weight"] = wavelet_weight_name(frame.weight);
  if (frame.camera && frame.camera != before.camera) out["camera"] = camera_json(*frame.camera);
  for (const auto& [start, name] : kStarts) {
    if (frame.start == start && start != FrameStart::advance) out["start"] = name;
  }
  return out;
}

}  // namespace

MotionRecording parse_motion(const std::string& text, const std::string& name) {
  if (json_nests_too_deep(text)) {
    refuse(name, fmt::format("nests deeper than {}, expected a recorded motion", kMostJsonDepth));
  }
  json root;
  try {
    root = json::parse(text);
  } catch (const json::exception& error) {
    refuse(name, fmt::format("is no JSON: {}", error.what()));
  }
  if (!root.is_object() || root.value("format", json()) != json(kFormat)) {
    refuse(name, fmt::format("is no recorded motion, expected \"format\": \"{}\"", kFormat));
  }
  if (root.value("version", json()) != json(kVersion)) {
    refuse(name, fmt::format("is a recorded motion of version {}, expected {}",
                             root.value("version", json()).dump(), kVersion));
  }
  MotionRecording recording;
  const json environments = root.value("environments", json());
  if (!environments.is_array() || environments.empty()) {
    refuse(name + ", environments", "is missing or empty, expected a list of files");
  }
  for (const json& file : environments) {
    recording.environments.emplace_back(word(file, name + ", environments"));
  }
  const json frames = root.value("frames", json());
  if (!frames.is_array() || frames.empty() || frames.size() > kMaxFrames) {
    refuse(name + ", frames", fmt::format("is missing, empty or too long, expected a list of 1 to "
                                          "{} frames",
                                          kMaxFrames));
  }
  RecordedFrame frame;
  for (const json& entry : frames) {
    const std::string where = fmt::format("{}, frame {}", name, recording.frames.size());
    if (!entry.is_object()) refuse(where, "is " + entry.dump() + ", expected an object");
    frame.start = FrameStart::advance;
    frame.course = {};
    for (const auto& [key, value] : entry.items()) read_key(key, value, where + ", " + key, frame);
    try {
      check_light_state(frame.light, recording.environments.size());
    } catch (const Error& error) {
      refuse(where, error.what());
    }
    recording.frames.push_back(frame);
  }
  return recording;
}

MotionRecording load_motion_file(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    throw Error(ErrorKind::missing, file.string() + ": no such file, expected a recorded motion");
  }
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  if (error || !stream) {
    throw Error(ErrorKind::io, file.string() + ": cannot read this file");
  }
  if (size > kMaxBytes) refuse(file.string(), "is larger than 1 GiB, expected a recorded motion");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  MotionRecording recording = parse_motion(text, file.string());
  for (std::filesystem::path& environment : recording.environments) {
    if (environment.is_relative()) environment = file.parent_path() / environment;
  }
  return recording;
}

std::string motion_text(const MotionRecording& recording) {
  std::string text =
      fmt::format("{{\n  \"format\": \"{}\",\n  \"version\": {},\n", kFormat, kVersion);
  json environments = json::array();
  for (const auto& file : recording.environments) environments.push_back(file.string());
  text += "  \"environments\": " + environments.dump() + ",\n  \"frames\": [";
  RecordedFrame before;
  const char* separator = "\n";
  for (const RecordedFrame& frame : recording.frames) {
    text += separator + ("    " + frame_json(frame, before).dump());
    before = frame;
    separator = ",\n";
  }
  return text + "\n  ]\n}\n";
}

void save_motion_file(const std::filesystem::path& file, const MotionRecording& recording) {
  if (recording.frames.empty() || recording.environments.empty()) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("recording has {} frames and {} environments, expected at least one",
                            recording.frames.size(), recording.environments.size()));
  }
  const std::string text = motion_text(recording);
  AtomicFile out(file);
  out.write(text.data(), text.size());
  out.commit();
}

}  // namespace haarlight
