// Which effects of light a transport holds.

#include "precompute/effects.h"

#include <fmt/format.h>

#include <charconv>

#include "core/error.h"

namespace haarlight {
namespace {

[[noreturn]] void refuse(std::string_view word) {
  throw Error(ErrorKind::invalid_argument,
              fmt::format("effect is \"{}\", expected all, none, or a list of shadows, "
                          "interreflection, interreflection=N (1 to {}), gloss, specular, "
                          "caustics, color",
                          word, kMostBounces));
}

}  // namespace

Effects all_effects() {
  Effects e;
  e.bounces = kMostBounces;
  return e;
}

std::string to_string(const Effects& e) {
  std::string text;
  const auto add = [&](bool on, const std::string& word) {
    if (on) text += (text.empty() ? "" : ",") + word;
  };
  add(e.shadows, "shadows");
  add(e.bounces > 0, fmt::format("interreflection={}", e.bounces));
  add(e.gloss, "gloss");
  add(e.specular, "specular");
  add(e.caustics, "caustics");
  add(e.color, "color");
  return text.empty() ? "none" : text;
}

Effects parse_effects(std::string_view list) {
  if (list == "all") return all_effects();
  Effects e{false, 0, false, false, false, false};
  if (list == "none") return e;
  for (bool more = true; more;) {
    const std::size_t comma = list.find(',');
    const std::string_view word = list.substr(0, comma);
    more = comma != std::string_view::npos;
    if (more) list.remove_prefix(comma + 1);
    constexpr std::string_view kBounces = "interreflection";
    if (word == "shadows") {
      e.shadows = true;
    } else if (word == "gloss") {
      e.gloss = true;
    } else if (word == "specular") {
      e.specular = true;
    } else if (word == "caustics") {
      e.caustics = true;
    } else if (word == "color") {
      e.color = true;
    } else if (word == kBounces) {
      e.bounces = kMostBounces;
    } else if (word.starts_with(kBounces) && word.size() > kBounces.size() + 1 &&
               word[kBounces.size()] == '=') {
      const std::string_view number = word.substr(kBounces.size() + 1);
      const auto [end, code] =
          std::from_chars(number.data(), number.data() + number.size(), e.bounces);
      if (code != std::errc{} || end != number.data() + number.size() || e.bounces < 1 ||
          e.bounces > kMostBounces) {
        refuse(word);
      }
    } else {
      refuse(word);
    }
  }
  return e;
}

}  // namespace haarlight
