// Dense columns of spherical harmonics.

#include "prt/sh_relighter.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/parallel.h"
#include "core/simd.h"
#include "prt/apply_kernel.h"
#include "prt/row_sums.h"

namespace haarlight {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kRows = static_cast<std::size_t>(kBlockRows);
constexpr auto kTotals = static_cast<std::size_t>(kBlockTotals);

double milliseconds_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

const Transport& checked(const Transport& transport, const ShOptions& options) {
  if (transport.kind() != TransportKind::image) {
    throw Error(ErrorKind::invalid_argument,
                "the transport is of a mesh, expected one of a picture");
  }
  if (options.incremental && options.terms < 1) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("terms is {}, expected at least 1", options.terms));
  }
  return transport;
}

bool any_rgb(const Transport& transport) {
  for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
    for (int word = 0; word < 4; ++word) {
      if (transport.rgb_blocks(chunk)[word]) return true;
    }
  }
  return false;
}

// Blocks of one chunk: totals += column * delta, channel by channel.
HAARLIGHT_MULTIVERSION void add_blocks(const float* column, std::size_t channels,
                                       std::size_t blocks, const double* delta, double* totals) {
  for (std::size_t block = 0; block < blocks; ++block) {
    for (std::size_t ch = 0; ch < 3; ++ch) {
      const float* from = column + (block * channels + (channels == 3 ? ch : 0)) * kRows;
      double* to = totals + block * kTotals + ch * kRows;
      for (std::size_t r = 0; r < kRows; ++r) to[r] += delta[ch] * static_cast<double>(from[r]);
    }
  }
}

}  // namespace

ShRelighter::ShRelighter(const Transport& transport, const ShOptions& options)
    : transport_(checked(transport, options)),
      options_(options),
      projection_(transport.layout(), options.order),
      rows_(static_cast<std::size_t>(transport.rows())),
      channels_(any_rgb(transport) ? 3 : 1),
      picture_(transport.width(), transport.height()) {
  const auto count = static_cast<std::size_t>(sh_count(options.order));
  columns_.resize(count * rows_ * channels_);
  norm_.resize(count);
  totals_.resize(3 * rows_);
  wanted_.resize(count);
  shown_.resize(count);
  deltas_.reserve(2 * count);

  // A grey column does not mind the light's colour: three functions go in one pass, as its
  // channels.
  const std::size_t together = channels_ == 1 ? 3 : 1;
  const auto size = static_cast<std::size_t>(transport.layout().size());
  RowSums sums(transport_);
  sums.expect_resets(false);
  for (std::size_t k = 0; k < count; k += together) {
    LightingUpdate update;
    update.reset.set();
    for (std::size_t j = 0; j < size; ++j) {
      const auto y = [&](std::size_t i) {
        return k + i < count ? static_cast<double>(projection_.haar(static_cast<int>(k + i))[j])
                             : 0.0;
      };
      const RgbD light = together == 3 ? RgbD{y(0), y(1), y(2)} : RgbD{y(0), y(0), y(0)};
      if (!(light == RgbD{})) update.deltas.push_back({static_cast<int>(j), light});
    }
    sums.apply(update);
    const std::span<const double> totals = sums.totals();
    for (std::size_t i = 0; i < together && k + i < count; ++i) {
      float* column = columns_.data() + (k + i) * rows_ * channels_;
      double squares = 0;
      for (std::size_t row = 0; row < rows_; ++row) {
        if (transport_.row_output()[row] == kNoOutput) continue;
        const std::size_t block = row / kRows, r = row % kRows;
        const RgbD color(transport_.row_color()[row]);
        const double of[3] = {color.r, color.g, color.b};
        for (std::size_t ch = 0; ch < 3; ++ch) {
          const double v = totals[block * kTotals + (together == 3 ? i : ch) * kRows + r];
          if (ch < channels_) {
            column[(block * channels_ + ch) * kRows + r] = static_cast<float>(v);
          }
          squares += of[ch] * of[ch] * v * v;
        }
      }
      norm_[k + i] = std::sqrt(squares);
    }
  }
}

void ShRelighter::choose(std::span<const RgbD> wanted, Frame& frame) {
  std::vector<std::pair<double, std::size_t>> ranked;
  for (int l = 0; l < options_.order; ++l) {
    const auto begin = static_cast<std::size_t>(l * l),
               end = static_cast<std::size_t>((l + 1) * (l + 1));
    double keep = 0, reset = 0, shown = 0;
    for (std::size_t k = begin; k < end; ++k) {
      keep += norm_[k] * l1_norm(wanted[k] - shown_[k]);
      reset += norm_[k] * l1_norm(wanted[k]);
      shown += l1_norm(shown_[k]);
    }
    const bool anew = shown > 0 && !(keep < reset);
    frame.resets += anew ? '1' : '0';
    for (std::size_t k = begin; k < end; ++k) {
      const RgbD from = anew ? RgbD{} : shown_[k];
      if (anew) deltas_.push_back({k, -shown_[k]});
      if (!(wanted[k] == from)) ranked.push_back({-norm_[k] * l1_norm(wanted[k] - from), k});
      if (anew) shown_[k] = {};
    }
  }
  std::sort(ranked.begin(), ranked.end());
  if (ranked.size() > static_cast<std::size_t>(options_.terms)) {
    ranked.resize(static_cast<std::size_t>(options_.terms));
  }
  frame.updates = static_cast<int>(ranked.size());
  for (const auto& [key, k] : ranked) {
    deltas_.push_back({k, wanted[k] - shown_[k]});
    shown_[k] = wanted[k];
  }
  // A function that is reset and chosen again is one column.
  std::stable_sort(deltas_.begin(), deltas_.end(),
                   [](const Delta& a, const Delta& b) { return a.function < b.function; });
  std::size_t out = 0;
  for (std::size_t i = 0; i < deltas_.size(); ++i) {
    if (out > 0 && deltas_[out - 1].function == deltas_[i].function) {
      deltas_[out - 1].delta += deltas_[i].delta;
    } else {
      deltas_[out++] = deltas_[i];
    }
  }
  deltas_.resize(out);
}

void ShRelighter::add(std::span<const Delta> deltas, bool from_zero) {
  const auto blocks = static_cast<std::size_t>(kChunkBlocks);
  parallel_for(transport_.chunk_count(), [&](int chunk) {
    const std::size_t first = static_cast<std::size_t>(chunk) * blocks;
    double* totals = totals_.data() + first * kTotals;
    if (from_zero) std::fill(totals, totals + blocks * kTotals, 0.0);
    for (const Delta& d : deltas) {
      const double delta[3] = {d.delta.r, d.delta.g, d.delta.b};
      add_blocks(columns_.data() + d.function * rows_ * channels_ + first * channels_ * kRows,
                 channels_, blocks, delta, totals);
    }
  });
}

void ShRelighter::finish() {
  parallel_for(transport_.chunk_count(), [&](int chunk) {
    const std::size_t first = static_cast<std::size_t>(chunk) * kChunkRows;
    for (std::size_t row = first; row < first + kChunkRows; ++row) {
      const std::uint32_t output = transport_.row_output()[row];
      if (output == kNoOutput) continue;
      const double* sum = totals_.data() + row / kRows * kTotals + row % kRows;
      picture_.pixels[output] = Rgb{static_cast<float>(sum[0]), static_cast<float>(sum[kRows]),
                                    static_cast<float>(sum[2 * kRows])} *
                                transport_.row_color()[row];
    }
  });
}

ShRelighter::Frame ShRelighter::relight(std::span<const Rgb> target, bool exact) {
  Frame frame;
  auto begin = Clock::now();
  projection_.project(target, wanted_);
  deltas_.clear();
  const bool from_zero = exact || !options_.incremental;
  if (from_zero) {
    if (wanted_ != shown_) {
      for (std::size_t k = 0; k < wanted_.size(); ++k) deltas_.push_back({k, wanted_[k]});
    }
    shown_ = wanted_;
    frame.updates = static_cast<int>(deltas_.size());
    frame.resets.assign(static_cast<std::size_t>(options_.order), deltas_.empty() ? '0' : '1');
  } else {
    choose(wanted_, frame);
  }
  frame.update_ms = milliseconds_since(begin);
  if (deltas_.empty()) return frame;
  begin = Clock::now();
  add(deltas_, from_zero);
  frame.stats.apply_ms = milliseconds_since(begin);
  begin = Clock::now();
  finish();
  frame.stats.finish_ms = milliseconds_since(begin);
  frame.stats.apply.columns = static_cast<int>(deltas_.size());
  frame.stats.apply.transport_bytes = deltas_.size() * column_bytes();
  frame.stats.apply.sum_bytes = (from_zero ? 1 : 2) * totals_.size() * sizeof(double);
  return frame;
}

}  // namespace haarlight
