// Scenes that move, as animated glTF.

#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace haarlight::data_gen {

struct AnimationEntry {
  std::string_view name;
  std::string_view description;
};

/// All of them, in the order of the help text. After Gautron and others 2007, section 6.
std::span<const AnimationEntry> animations();

/// Writes the animation of that name as .glb. Returns the number of triangles in it. Atomic.
/// Throws Error{invalid_argument} for another name or suffix, Error{io} if the system refuses.
std::size_t save_animation(const std::filesystem::path& file, std::string_view name);

}  // namespace haarlight::data_gen
