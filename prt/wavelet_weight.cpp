// Weights of wavelets by name and by transport.

#include "prt/wavelet_weight.h"

#include <array>
#include <cstddef>
#include <span>
#include <utility>

#include "prt/lighting_tracker.h"

namespace haarlight {
namespace {

constexpr std::array<std::pair<WaveletWeight, std::string_view>, 3> kWeightNames{{
    {WaveletWeight::none, "none"},
    {WaveletWeight::area, "area"},
    {WaveletWeight::transport, "transport"},
}};

}  // namespace

std::optional<WaveletWeight> wavelet_weight_from_name(std::string_view name) {
  for (const auto& [weight, word] : kWeightNames) {
    if (word == name) return weight;
  }
  return std::nullopt;
}

std::string wavelet_weight_name(WaveletWeight weight) {
  return std::string(kWeightNames[static_cast<std::size_t>(weight)].second);
}

std::vector<float> wavelet_weights(WaveletWeight weight, const Transport& transport) {
  const HaarLayout& layout = transport.layout();
  switch (weight) {
    case WaveletWeight::area:
      return area_weights(layout);
    case WaveletWeight::transport: {
      const std::span<const float> norms = transport.column_norms();
      return {norms.begin(), norms.end()};
    }
    case WaveletWeight::none:
      break;
  }
  return std::vector<float>(static_cast<std::size_t>(layout.size()), 1.0f);
}

}  // namespace haarlight
