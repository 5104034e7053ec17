// Scenes that move, as animated glTF.

#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "precompute/scene.h"

namespace haarlight::data_gen {

struct AnimationEntry {
  std::string_view name;
  std::string_view description;
};

/// What some of them can be told.
struct AnimationOptions {
  int count = 1;                ///< bunnies: how many of the nine move, 1 to 9
  std::optional<Scene> figure;  ///< bunnies, cornell-bunny: in place of the bunny, its first
                                ///< material's colour aside; it is scaled to its height
};

/// All of them, in the order of the help text. After Gautron and others 2007, section 6, and
/// Debattista and others 2009, section 4.
std::span<const AnimationEntry> animations();

/// Writes the animation of that name as .glb. Returns the number of triangles in it. Atomic.
/// Throws Error{invalid_argument} for another name, suffix or count, Error{io} if the system
/// refuses.
std::size_t save_animation(const std::filesystem::path& file, std::string_view name,
                           const AnimationOptions& options = {});

}  // namespace haarlight::data_gen
