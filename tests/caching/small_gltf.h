// A small animated glTF file to take apart.

#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace haarlight {

/// One triangle on a node that two clips move, a camera, a spot light and a morph target.
struct SmallGltf {
  nlohmann::json gltf;
  std::string bytes;  ///< of its one buffer

  std::size_t add(const std::vector<float>& values, const char* type, std::size_t width) {
    const std::size_t begin = bytes.size();
    bytes.resize(begin + values.size() * sizeof(float));
    std::memcpy(bytes.data() + begin, values.data(), values.size() * sizeof(float));
    gltf["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", values.size() * sizeof(float)}});
    nlohmann::json accessor{{"bufferView", gltf["bufferViews"].size() - 1},
                            {"componentType", 5126},
                            {"count", values.size() / width},
                            {"type", type}};
    gltf["accessors"].push_back(accessor);
    return gltf["accessors"].size() - 1;
  }

  SmallGltf() {
    gltf["asset"]["version"] = "2.0";
    const auto position = add({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3", 3);
    const auto morph = add({0, 0, 2, 0, 0, 0, 0, 0, 0}, "VEC3", 3);
    const auto time = add({0, 1}, "SCALAR", 1);
    const auto move = add({0, 0, 0, 4, 0, 0}, "VEC3", 3);
    const float half = std::sqrt(0.5f);
    const auto turn = add({0, 0, 0, 1, 0, 0, half, half}, "VEC4", 4);
    const auto weight = add({0, 1}, "SCALAR", 1);
    const auto glow = add({0, 0, 0, 1, 1, 0.5f}, "VEC3", 3);
    gltf["materials"] = nlohmann::json::array({{{"name", "paint"}}});
    gltf["meshes"] = nlohmann::json::array(
        {{{"primitives", nlohmann::json::array(
                             {{{"attributes", {{"POSITION", position}}},
                               {"material", 0},
                               {"targets", nlohmann::json::array({{{"POSITION", morph}}})}}})}}});
    gltf["cameras"] = nlohmann::json::array(
        {{{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.1}}}}});
    gltf["extensions"]["KHR_lights_punctual"]["lights"] =
        nlohmann::json::array({{{"type", "spot"}, {"intensity", 3}, {"color", {1, 0.5, 0.25}}}});
    nlohmann::json lamp{{"translation", {0, 5, 0}}};
    lamp["extensions"]["KHR_lights_punctual"]["light"] = 0;
    gltf["nodes"] = nlohmann::json::array(
        {{{"children", {1}}}, {{"mesh", 0}}, {{"camera", 0}, {"translation", {0, 0, 9}}}, lamp});
    gltf["scenes"] = nlohmann::json::array({{{"nodes", {0, 2, 3}}}});
    gltf["scene"] = 0;
    const auto sampler = [&](std::size_t output) {
      return nlohmann::json{{"input", time}, {"output", output}};
    };
    nlohmann::json pointed{{"path", "pointer"}};
    pointed["extensions"]["KHR_animation_pointer"]["pointer"] = "/materials/0/emissiveFactor";
    gltf["animations"] = nlohmann::json::array(
        {{{"samplers", {sampler(move), sampler(weight)}},
          {"channels",
           {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}},
            {{"sampler", 1}, {"target", {{"node", 1}, {"path", "weights"}}}}}}},
         {{"samplers", {sampler(turn), sampler(glow)}},
          {"channels",
           {{{"sampler", 0}, {"target", {{"node", 1}, {"path", "rotation"}}}},
            {{"sampler", 1}, {"target", pointed}}}}}});
  }

  /// As one file.
  std::string glb() {
    gltf["buffers"] = nlohmann::json::array({{{"byteLength", bytes.size()}}});
    std::string text = gltf.dump();
    while (text.size() % 4 != 0) text += ' ';
    const auto word = [](std::size_t value) {
      const auto bits = static_cast<std::uint32_t>(value);
      return std::string(reinterpret_cast<const char*>(&bits), sizeof bits);
    };
    const std::string chunks =
        word(text.size()) + "JSON" + text + word(bytes.size()) + std::string("BIN\0", 4) + bytes;
    return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
  }
};

}  // namespace haarlight
