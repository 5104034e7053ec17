// Whether a transport shows all that was asked for.

#include "prt/completeness.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace haarlight {

std::string incomplete_note(const std::string& meta) {
  const nlohmann::json made = nlohmann::json::parse(meta, nullptr, false);
  if (!made.is_object() || !made.contains("complete") || made["complete"] != false) return {};
  const auto number = [&](const char* key) {
    return made.contains(key) && made[key].is_number() ? made[key].get<double>() : 0.0;
  };
  const double tiles = number("tiles");
  const double share = tiles > 0 ? number("tiles_traced") / tiles : 0;
  return fmt::format("{:.0f} % of tiles traced, the rest is a preview", std::floor(100 * share));
}

}  // namespace haarlight
