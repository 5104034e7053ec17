// Checking, packing and reading the view factors of a transport.

#include "prt/view_factors.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "core/error.h"
#include "prt/packing.h"
#include "prt/transport_format.h"

namespace haarlight {
namespace {

using Counts = std::array<std::uint32_t, 4>;  // sets, terms, resolution, vertices
constexpr std::size_t kCountsBytes = sizeof(Counts);

}  // namespace

RgbD view_factor(const ViewFactors& factors, std::size_t set, std::size_t term, const Vec3& local) {
  const double cosine = std::clamp(local.z, 0.0, 1.0);
  const std::span<const Rgb> profile = factors.profile_of(set, term);
  const double at = std::sqrt(1 - cosine) * static_cast<double>(profile.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), profile.size() - 2);
  const double share = at - static_cast<double>(i);
  const RgbD value = RgbD(profile[i]) * (1 - share) + RgbD(profile[i + 1]) * share;
  const int m = factors.order[set * static_cast<std::size_t>(factors.terms) + term];
  const double phi = std::atan2(local.y, local.x);
  return value * (m >= 0 ? std::cos(m * phi) : std::sin(-m * phi));
}

std::string check_view_factors(const ViewFactors& f, std::size_t vertices) {
  if (f.terms < 1 || f.terms > kMaxTerms) {
    return fmt::format("view factors have {} terms, expected 1 to {}", f.terms, kMaxTerms);
  }
  if (f.resolution < 2 || f.resolution > kMostViewResolution) {
    return fmt::format("profiles of view factors have {} samples, expected 2 to {}", f.resolution,
                       kMostViewResolution);
  }
  const std::size_t sets = f.sets();
  if (sets < 1 || sets > kMostViewSets ||
      sets * static_cast<std::size_t>(f.terms) != f.order.size() ||
      f.profile.size() != f.order.size() * static_cast<std::size_t>(f.resolution)) {
    return fmt::format("view factors have {} orders and {} samples, expected {} terms of {} a set",
                       f.order.size(), f.profile.size(), f.terms, f.resolution);
  }
  if (f.set_of.size() != vertices) {
    return fmt::format("view factors are of {} vertices, expected {}", f.set_of.size(), vertices);
  }
  for (const int m : f.order) {
    if (std::abs(std::int64_t{m}) > kMostViewOrder) {
      return fmt::format("a view factor is of order {}, expected -{} to {}", m, kMostViewOrder,
                         kMostViewOrder);
    }
  }
  for (const Rgb& sample : f.profile) {
    if (!is_finite(sample)) return "a view factor is not finite";
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    if (f.set_of[v] >= sets) {
      return fmt::format("vertex {} has view factors {}, expected one below {}", v, f.set_of[v],
                         sets);
    }
  }
  return {};
}

std::vector<std::byte> pack_view_factors(const ViewFactors& f) {
  std::vector<std::byte> plain(f.order.size() * sizeof(int) + f.profile.size() * sizeof(Rgb) +
                               f.set_of.size() * sizeof(std::uint32_t));
  put(put(put(plain.data(), f.order), f.profile), f.set_of);
  std::vector<std::byte> packed = compress_bytes(plain, kCountsBytes);
  const Counts counts{static_cast<std::uint32_t>(f.sets()), static_cast<std::uint32_t>(f.terms),
                      static_cast<std::uint32_t>(f.resolution),
                      static_cast<std::uint32_t>(f.set_of.size())};
  std::memcpy(packed.data(), counts.data(), kCountsBytes);
  return packed;
}

ViewFactors unpack_view_factors(std::span<const std::byte> packed, int terms, std::size_t vertices,
                                const std::string& name) {
  const auto damaged = [&name](const std::string& what) {
    return Error(ErrorKind::format, fmt::format("{}: {}", name, what));
  };
  if (packed.size() < kCountsBytes) throw damaged("view factors are cut short");
  Counts counts;
  std::memcpy(counts.data(), packed.data(), kCountsBytes);
  const auto [sets, of_terms, resolution, of_vertices] = counts;
  if (sets < 1 || sets > kMostViewSets || std::int64_t{of_terms} != terms || resolution < 2 ||
      resolution > static_cast<std::uint32_t>(kMostViewResolution) || of_vertices != vertices) {
    throw damaged(
        fmt::format("{} sets of {} view factors, {} samples each, for {} vertices do not "
                    "fit a mesh of {} terms and {} vertices",
                    sets, of_terms, resolution, of_vertices, terms, vertices));
  }
  const std::size_t count = std::size_t{sets} * of_terms;
  const std::size_t samples = count * resolution;
  const std::size_t bounded = count * sizeof(int) + samples * sizeof(Rgb);
  const std::vector<std::byte> plain =
      decompress_bytes(packed.subspan(kCountsBytes), bounded + vertices * sizeof(std::uint32_t),
                       bounded, name, "view factors");
  ViewFactors f;
  f.terms = terms;
  f.resolution = static_cast<int>(resolution);
  take(take(take(plain.data(), f.order, count), f.profile, samples), f.set_of, vertices);
  const std::string wrong = check_view_factors(f, vertices);
  if (!wrong.empty()) throw damaged(wrong);
  return f;
}

}  // namespace haarlight
