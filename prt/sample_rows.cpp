// Rows taken out of the columns of a transport, and multiplied.

#include "prt/sample_rows.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/stored_blocks.h"
#include "prt/tile_codec.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kBlockRows);
constexpr std::size_t kBlock = 3 * kRows;
constexpr int kColumnsOfSlice = 256;

typedef float Lanes __attribute__((vector_size(16), aligned(4)));

Lanes lanes(const Rgb& c) { return Lanes{c.r, c.g, c.b, 0}; }

}  // namespace

SampleRows::SampleRows(const Transport& transport, std::vector<RowSum> sums)
    : sums_(std::move(sums)) {
  place_of_block_.assign(static_cast<std::size_t>(transport.rows()) / kRows, -1);
  for (std::uint32_t s = 0; s < sums_.size(); ++s) {
    const std::size_t begin = sums_[s].first_row, end = begin + sums_[s].weight.size();
    bool rgb = false;
    for (std::size_t row = begin; row < end; ++row) {
      const std::size_t block = row / kRows, bit = block % kChunkBlocks;
      rgb |= transport.rgb_blocks(static_cast<int>(block / kChunkBlocks))[bit / 64] >> bit % 64 & 1;
      std::int32_t& place = place_of_block_[block];
      if (place < 0) place = static_cast<std::int32_t>(places_++);
    }
    first_line_.push_back(static_cast<std::uint32_t>(lines_.size()));
    for (int ch = rgb ? 0 : -1; ch < (rgb ? 3 : 0); ++ch) lines_.push_back({s, ch});
  }
  if (lines_.size() > kMostSampleLines) {
    throw Error(ErrorKind::invalid_argument, "too many rows to sample, expected up to 21845");
  }
  const int columns = transport.layout().size();
  slices_.resize(static_cast<std::size_t>((columns + kColumnsOfSlice - 1) / kColumnsOfSlice));
  parallel_for(static_cast<int>(slices_.size()), [&](int slice) {
    read_slice(transport, slice, slices_[static_cast<std::size_t>(slice)]);
  });
  sum_.resize(lines_.size() * 6);
}

void SampleRows::read_slice(const Transport& transport, int slice, Slice& out) const {
  const int begin = slice * kColumnsOfSlice;
  const int end = std::min(begin + kColumnsOfSlice, transport.layout().size());
  std::vector<float> value(places_ * kBlock);  // [place][channel][row of block], of one column
  std::vector<std::int32_t> read(places_, -1);
  std::vector<std::uint16_t> line;
  std::vector<float> entry;
  out.first.push_back(0);
  for (int j = begin; j < end; ++j) {
    for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
      for_stored_blocks(
          transport.column(chunk, j), transport.rgb_blocks(chunk),
          [&](std::size_t block, bool rgb, const std::uint16_t* scale, const std::int8_t* q) {
            const std::int32_t place =
                place_of_block_[static_cast<std::size_t>(chunk) * kChunkBlocks + block];
            if (place < 0) return;
            const auto at = static_cast<std::size_t>(place);
            read[at] = j;
            for (std::size_t k = 0; k < kBlock; ++k) {
              const std::size_t from = rgb ? k : k % kRows;
              value[at * kBlock + k] =
                  static_cast<float>(q[from]) * scale_from_bits(scale[from / kRows]);
            }
          });
    }
    for (std::size_t s = 0; s < sums_.size(); ++s) {
      const RowSum& sum = sums_[s];
      float total[3] = {};
      for (std::size_t i = 0; i < sum.weight.size(); ++i) {
        const std::size_t row = sum.first_row + i;
        const auto at = static_cast<std::size_t>(place_of_block_[row / kRows]);
        if (read[at] != j) continue;
        for (std::size_t ch = 0; ch < 3; ++ch) {
          total[ch] += sum.weight[i] * value[at * kBlock + ch * kRows + row % kRows];
        }
      }
      for (std::size_t l = first_line_[s]; l < lines_.size() && lines_[l].sum == s; ++l) {
        const float x = total[std::max(lines_[l].channel, 0)];
        if (x == 0) continue;
        line.push_back(static_cast<std::uint16_t>(l));
        entry.push_back(x);
      }
    }
    out.first.push_back(static_cast<std::uint32_t>(line.size()));
  }
  out.line.resize(line.size());
  out.value.resize(entry.size());
  std::copy(line.begin(), line.end(), out.line.begin());
  std::copy(entry.begin(), entry.end(), out.value.begin());
  out.change.resize(4 * lines_.size());
  out.light.resize(4 * lines_.size());
}

void SampleRows::multiply(std::span<const Rgb> target, std::span<const Rgb> shown,
                          std::vector<RgbD>& change, std::vector<RgbD>& light) {
  parallel_for(static_cast<int>(slices_.size()), [&](int slice) {
    Slice& s = slices_[static_cast<std::size_t>(slice)];
    std::fill(s.change.begin(), s.change.end(), 0.0f);
    std::fill(s.light.begin(), s.light.end(), 0.0f);
    for (std::size_t i = 0; i + 1 < s.first.size(); ++i) {
      const std::size_t j = static_cast<std::size_t>(slice) * kColumnsOfSlice + i;
      const Lanes l = lanes(target[j]), d = lanes(target[j] - shown[j]);
      for (std::size_t at = s.first[i]; at < s.first[i + 1]; ++at) {
        const std::size_t line = 4 * std::size_t{s.line[at]};
        *reinterpret_cast<Lanes*>(s.change.data() + line) += s.value[at] * d;
        *reinterpret_cast<Lanes*>(s.light.data() + line) += s.value[at] * l;
      }
    }
  });
  std::fill(sum_.begin(), sum_.end(), 0.0);
  for (const Slice& s : slices_) {
    for (std::size_t l = 0; l < lines_.size(); ++l) {
      for (std::size_t ch = 0; ch < 3; ++ch) {
        sum_[6 * l + ch] += static_cast<double>(s.change[4 * l + ch]);
        sum_[6 * l + 3 + ch] += static_cast<double>(s.light[4 * l + ch]);
      }
    }
  }
  change.assign(sums_.size(), RgbD{});
  light.assign(sums_.size(), RgbD{});
  for (std::size_t l = 0; l < lines_.size(); ++l) {
    const RgbD color(sums_[lines_[l].sum].color);
    const double* x = sum_.data() + 6 * l;
    const int ch = lines_[l].channel;
    const auto of = [&](const double* v) {
      return ch < 0 ? RgbD{v[0], v[1], v[2]}
                    : RgbD{ch == 0 ? v[0] : 0, ch == 1 ? v[1] : 0, ch == 2 ? v[2] : 0};
    };
    change[lines_[l].sum] += color * of(x);
    light[lines_[l].sum] += color * of(x + 3);
  }
}

void SampleRows::take_away(int index, const Rgb& difference, std::vector<RgbD>& change) const {
  const Slice& s = slices_[static_cast<std::size_t>(index / kColumnsOfSlice)];
  const auto i = static_cast<std::size_t>(index % kColumnsOfSlice);
  for (std::size_t at = s.first[i]; at < s.first[i + 1]; ++at) {
    const Line& line = lines_[s.line[at]];
    RgbD& sum = change[line.sum];
    const RgbD part = RgbD(sums_[line.sum].color) * RgbD(s.value[at] * difference);
    if (line.channel < 0 || line.channel == 0) sum.r -= part.r;
    if (line.channel < 0 || line.channel == 1) sum.g -= part.g;
    if (line.channel < 0 || line.channel == 2) sum.b -= part.b;
  }
}

void SampleRows::add_rows(std::span<const double> rows, std::vector<RgbD>& change) const {
  for (std::size_t s = 0; s < sums_.size(); ++s) {
    RgbD total;
    for (std::size_t i = 0; i < sums_[s].weight.size(); ++i) {
      const double* row = rows.data() + 3 * (sums_[s].first_row + i);
      total += static_cast<double>(sums_[s].weight[i]) * RgbD{row[0], row[1], row[2]};
    }
    change[s] += RgbD(sums_[s].color) * total;
  }
}

std::uint64_t SampleRows::bytes() const {
  std::uint64_t bytes = 0;
  for (const Slice& s : slices_) {
    bytes += 6 * s.value.size() + 4 * (s.first.size() + s.change.size() + s.light.size());
  }
  return bytes;
}

}  // namespace haarlight
