// The receivers of one tile -> its exact rows of the transport.

#include "precompute/tile_tracer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>

#include "core/error.h"
#include "precompute/row_color.h"
#include "precompute/row_products.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kTileRows);

double channel(const RgbD& c, std::size_t i) { return i == 0 ? c.r : i == 1 ? c.g : c.b; }

// The colours of a receiver's parts as its row shows them.
std::array<RgbD, 3> part_colors(const Receiver& r) {
  const Bsdf& b = r.bsdf;
  return {r.weight * b.diffuse_out(b.to_viewer), b.has_lobe() ? r.weight * b.gloss_first : RgbD{},
          b.has_lobe() ? r.weight * b.gloss_second : RgbD{}};
}

// Whether the row's colour cannot be told from the colours of its parts: Fresnel mixes them.
bool colors_vary(const Receiver& r) { return r.bsdf.lobe == Bsdf::Lobe::ggx; }

const TraceOptions& checked(const TraceOptions& options) {
  check(options);
  return options;
}

}  // namespace

void check(const TraceOptions& options) {
  const auto refuse = [](const char* name, auto value, const char* wanted) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} is {}, expected {}", name, value, wanted));
  };
  if (options.face_size < 4 || options.face_size > 256 ||
      !std::has_single_bit(static_cast<unsigned>(options.face_size))) {
    refuse("face size", options.face_size, "a power of two from 4 to 256");
  }
  if (options.spp < 1 || options.spp > 64) refuse("spp", options.spp, "1 to 64 rays a texel");
  if (options.pixel_samples != 1 && options.pixel_samples != 4 && options.pixel_samples != 16) {
    refuse("pixel samples", options.pixel_samples, "1, 4 or 16");
  }
  if (options.effects.bounces < 0 || options.effects.bounces > kMostBounces) {
    refuse("bounces", options.effects.bounces, "0 to 64");
  }
  if (options.effects.bounces > 0 && !options.effects.shadows) {
    refuse("bounces", options.effects.bounces,
           "0 without shadows: light that passes through "
           "surfaces is not reflected by them");
  }
  if (options.indirect_face < 4 ||
      !std::has_single_bit(static_cast<unsigned>(options.indirect_face))) {
    refuse("indirect face size", options.indirect_face, "a power of two from 4");
  }
  if (!(options.noise > 0) || !(options.noise <= 1)) {
    refuse("noise", options.noise, "above 0 and at most 1");
  }
  if (options.paths < 1 || options.paths > 1 << 20) refuse("paths", options.paths, "1 to 1048576");
}

TileTracer::TileTracer(const Scene& scene, const Visibility& visibility,
                       const TraceOptions& options)
    : scene_(scene),
      visibility_(visibility),
      options_(checked(options)),
      layout_(options.face_size),
      table_(options.face_size, options.spp),
      points_(visibility, table_, options.adaptive, options.effects.shadows) {
  if (options.effects.bounces > 0) {
    paths_.emplace(scene, visibility, table_, options.effects,
                   std::min(options.indirect_face, options.face_size), options.seed);
  }
}

TileTracer::TileTracer(const Scene& scene, const Visibility& visibility, const Camera& camera,
                       const TraceOptions& options)
    : TileTracer(scene, visibility, options) {
  width_ = camera.width;
  pixels_.emplace(scene, visibility, camera, options.pixel_samples, options.effects);
}

void TileTracer::find_receivers(std::span<const std::uint32_t> outputs, TileReceivers& receivers,
                                RayCounts& counts) const {
  receivers.clear();
  receivers.coverage.assign(kRows, 0.0f);
  for (std::size_t row = 0; row < kRows; ++row) {
    if (outputs[row] == kNoOutput) continue;
    const auto output = static_cast<int>(outputs[row]);
    receivers.coverage[row] = static_cast<float>(pixels_->sample(
        output % width_, output / width_, static_cast<std::uint32_t>(row), receivers, counts));
  }
}

void TileTracer::trace(std::span<const std::uint32_t> outputs, Scratch& scratch, TileRows& tile,
                       RayCounts& counts, TileNoise* noise) const {
  find_receivers(outputs, scratch.receivers, counts);
  trace(scratch.receivers, scratch, tile, counts, noise);
}

// What reaches a receiver directly, in each of `channels`: three, or one grey in units of `base`.
// It replaces what is there if the receiver is the row's first.
void TileTracer::add_direct(const Receiver& receiver, bool first, Scratch& scratch,
                            std::span<float* const> channels, const RgbD& base,
                            RayCounts& counts) const {
  const auto size = static_cast<std::size_t>(layout_.size());
  const ShadingPoint point = shading_point(receiver);
  const std::array<RgbD, 3> color = part_colors(receiver);
  scratch.deposits.clear();
  points_.trace(point, {scratch.diffuse, scratch.first, scratch.second, &scratch.deposits},
                scratch.point, counts);
  if (options_.effects.caustics && options_.effects.shadows && visibility_.has_specular()) {
    points_.trace_caustics(scene_, point, scratch.point, scratch.deposits, counts);
  }
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto factor = [&](const RgbD& value) {
      return static_cast<float>(channels.size() == 1 ? multiple_of(value, base)
                                                     : channel(value, c));
    };
    std::array<RowPart, 3> parts;
    std::size_t count = 0;
    parts[count++] = {scratch.diffuse.data(), factor(color[0])};
    if (point.glossy) {
      parts[count++] = {scratch.first.data(), factor(color[1])};
      if (l1_norm(color[2]) > 0) parts[count++] = {scratch.second.data(), factor(color[2])};
    }
    add_row_parts(std::span(parts).first(count), size, !first, channels[c]);
    for (const Deposit& d : scratch.deposits) {
      channels[c][d.texel] += factor(receiver.weight * d.value);
    }
  }
}

// The direct light of all terms of one vertex, which look from one place: by the first of them.
// Replaces what is in their rows.
void TileTracer::add_terms(const TileReceivers& receivers, std::size_t first, Scratch& scratch,
                           const std::function<float*(std::size_t channel, std::size_t row)>& to,
                           std::span<const bool> open, std::span<const RgbD> base,
                           RayCounts& counts) const {
  const auto size = static_cast<std::size_t>(layout_.size());
  std::vector<std::size_t> of_vertex;
  std::vector<const IncomingTerm*> terms;
  for (std::size_t i = first; i < receivers.receivers.size(); ++i) {
    const Receiver& r = receivers.receivers[i];
    if (!r.bsdf.term || r.vertex != receivers.receivers[first].vertex) continue;
    of_vertex.push_back(i);
    terms.push_back(r.bsdf.term);
  }
  scratch.term_rows.resize(terms.size() * size);
  std::vector<std::span<float>> rows;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    rows.push_back(std::span(scratch.term_rows).subspan(k * size, size));
  }
  points_.trace_terms(shading_point(receivers.receivers[first]), terms, rows, scratch.point,
                      counts);
  const bool caustics =
      options_.effects.caustics && options_.effects.shadows && visibility_.has_specular();
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const Receiver& r = receivers.receivers[of_vertex[k]];
    scratch.term_done.push_back(of_vertex[k]);
    scratch.deposits.clear();
    if (caustics) {
      points_.trace_caustics(scene_, shading_point(r), scratch.point, scratch.deposits, counts);
    }
    for (std::size_t c = 0; c < (open[r.row] ? 3u : 1u); ++c) {
      const auto factor = [&](const RgbD& value) {
        return static_cast<float>(open[r.row] ? channel(value, c)
                                              : multiple_of(value, base[r.row]));
      };
      float* const sum = to(c, r.row);
      const float f = factor(r.weight);
      for (std::size_t t = 0; t < size; ++t) sum[t] = f * rows[k][t];
      for (const Deposit& d : scratch.deposits) sum[d.texel] += factor(r.weight * d.value);
    }
  }
}

void TileTracer::trace(const TileReceivers& receivers, Scratch& scratch, TileRows& tile,
                       RayCounts& counts, TileNoise* noise) const {
  const auto size = static_cast<std::size_t>(layout_.size());
  scratch.diffuse.resize(size);
  scratch.first.resize(size);
  scratch.second.resize(size);
  scratch.of_row.resize(kRows);
  for (auto& list : scratch.of_row) list.clear();
  for (std::size_t i = 0; i < receivers.receivers.size(); ++i) {
    scratch.of_row[receivers.receivers[i].row].push_back(i);
  }
  tile.color.assign(kRows, Rgb{1, 1, 1});
  tile.coverage = receivers.coverage;

  // Rows whose colour is known before they are traced: all parts are multiples of one.
  const bool mixed = paths_.has_value() || (options_.effects.caustics && options_.effects.shadows &&
                                            visibility_.has_specular());
  std::array<bool, kRows> known{};
  std::array<RgbD, kRows> base{};
  for (std::size_t row = 0; row < kRows; ++row) {
    RgbD sum;
    double weight = 0;
    for (const std::size_t i : scratch.of_row[row]) {
      for (const RgbD& c : part_colors(receivers.receivers[i])) sum += c;
      weight += luminance(receivers.receivers[i].weight);
    }
    base[row] = weight > 0 ? sum * (1 / weight) : RgbD{};
    known[row] = !mixed;
    for (const std::size_t i : scratch.of_row[row]) {
      if (colors_vary(receivers.receivers[i])) known[row] = false;
      for (const RgbD& c : part_colors(receivers.receivers[i])) {
        if (!is_multiple(c, base[row])) known[row] = false;
      }
    }
  }
  for (const Escape& e : receivers.escapes) known[e.row] = false;
  unsigned open_blocks = 0;  // rows of which are traced in three channels
  for (std::size_t row = 0; row < kRows; ++row) {
    if (!known[row]) open_blocks |= 1u << (row / kBlockRows);
  }

  // Direct light, [channel][row][texel].
  const std::size_t channels = open_blocks == 0 ? 1 : 3;
  scratch.texels.resize(std::max(scratch.texels.size(), channels * kRows * size));
  const auto row_of = [&](std::size_t c, std::size_t row) {
    return scratch.texels.data() + (c * kRows + row) * size;
  };
  if (paths_) paths_->begin(*scratch.paths);
  std::array<bool, kRows> is_open{};
  for (std::size_t row = 0; row < kRows; ++row) {
    is_open[row] = (open_blocks >> (row / kBlockRows) & 1u) != 0;
  }
  scratch.term_done.clear();
  for (std::size_t row = 0; row < kRows; ++row) {
    const bool open = is_open[row];
    const std::size_t own_channels = open ? 3 : 1;
    std::array<float*, 3> to{};
    for (std::size_t c = 0; c < own_channels; ++c) to[c] = row_of(c, row);
    const std::span<float* const> into(to.data(), own_channels);
    bool first = true;
    for (const std::size_t i : scratch.of_row[row]) {
      if (receivers.receivers[i].bsdf.term) {  // alone in its row
        if (std::find(scratch.term_done.begin(), scratch.term_done.end(), i) ==
            scratch.term_done.end()) {
          add_terms(receivers, i, scratch, row_of, is_open, base, counts);
        }
      } else {
        add_direct(receivers.receivers[i], first, scratch, into, base[row], counts);
      }
      first = false;
    }
    if (first) {
      for (float* channel_row : into) std::fill_n(channel_row, size, 0.0f);
    }
    if (!open && !first) tile.color[row] = Rgb(base[row]);
    for (const Escape& e : receivers.escapes) {
      if (e.row != row) continue;
      const std::size_t texel = texel_of(e.direction, layout_.face_size());
      for (std::size_t c = 0; c < 3; ++c) to[c][texel] += static_cast<float>(channel(e.weight, c));
    }
    if (!paths_ || receivers.coverage[row] <= 0) continue;
    for (std::size_t c = 0; c < 3; ++c) paths_->add_direct(row, c, to[c], *scratch.paths);
  }

  if (paths_) {
    TileNoise own;
    paths_->trace(receivers, {options_.noise, options_.paths}, *scratch.paths, noise ? *noise : own,
                  counts);
  }

  // Which of the open blocks are of one colour a row after all.
  tile.rgb_blocks = 0;
  std::array<RgbD, kRows> fit{};
  for (std::size_t block = 0; block < kTileBlocks; ++block) {
    if (!(open_blocks >> block & 1u)) continue;
    bool grey = true;
    for (std::size_t row = block * kBlockRows; row < (block + 1) * kBlockRows; ++row) {
      if (paths_ && !scratch.of_row[row].empty()) {
        for (std::size_t c = 0; c < 3; ++c) paths_->add_to(row, c, row_of(c, row), *scratch.paths);
      }
      const ColorFit found = fit_color(row_of(0, row), row_of(1, row), row_of(2, row), size);
      fit[row] = found.color;
      if (found.residual > 0.01) grey = false;
    }
    if (options_.effects.color && !grey) {
      tile.rgb_blocks |= 1u << block;
      continue;
    }
    for (std::size_t row = block * kBlockRows; row < (block + 1) * kBlockRows; ++row) {
      to_grey(fit[row], row_of(0, row), row_of(1, row), row_of(2, row), size);
      if (l1_norm(fit[row]) > 0) tile.color[row] = Rgb(fit[row]);
    }
  }

  const auto start = std::chrono::steady_clock::now();
  const std::size_t stored = tile.rgb_blocks == 0 ? 1 : 3;
  tile.values.resize(stored * kRows * size);
  for (std::size_t c = 0; c < stored; ++c) {
    for (std::size_t row = 0; row < kRows; ++row) {
      const std::span<float> to(tile.values.data() + (c * kRows + row) * size, size);
      const bool used = c == 0 || (tile.rgb_blocks >> (row / kBlockRows) & 1u) != 0;
      if (used && receivers.coverage[row] > 0) {
        haar_forward(layout_, std::span<const float>(row_of(c, row), size), to);
      } else {
        std::fill(to.begin(), to.end(), 0.0f);
      }
    }
  }
  scratch.transform_seconds +=
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace haarlight
