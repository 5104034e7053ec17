// What a transport's description says of its quality.

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

std::optional<double> measured_error(const std::string& meta) {
  const nlohmann::json made = nlohmann::json::parse(meta, nullptr, false);
  if (!made.is_object()) return std::nullopt;
  const auto found = made.find("measured_error");
  if (found == made.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

}  // namespace haarlight
