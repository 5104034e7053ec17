// Which effects of light a transport holds.

#pragma once

#include <string>
#include <string_view>

namespace haarlight {

/// Interreflections are followed at most so far; paths end earlier by Russian roulette.
inline constexpr int kMostBounces = 64;

/// What is simulated. Plain switches: what is off costs nothing.
struct Effects {
  bool shadows = true;  ///< the scene blocks light; off: only a surface's own horizon does
  int bounces = 0;    ///< interreflections between surfaces that are no mirrors, [0, kMostBounces]
  bool gloss = true;  ///< Phong and GGX lobes; off: the diffuse part alone
  bool specular = true;  ///< mirrors and glass as seen in the picture; off: they are black
  bool caustics = true;  ///< light that comes by way of mirrors and glass; off: they only block it
  bool color = true;     ///< three channels where one colour does not factor out of a row

  friend bool operator==(const Effects&, const Effects&) = default;
};

/// Everything there is.
Effects all_effects();

/// "direct", or the words of what is on: "shadows,interreflection=3,gloss,specular,caustics,color".
std::string to_string(const Effects& effects);

/// The inverse of to_string(), and "all"; "interreflection" alone means kMostBounces, "none"
/// nothing but light from above the horizon. Throws Error{invalid_argument} naming the word that is
/// none.
Effects parse_effects(std::string_view list);

}  // namespace haarlight
