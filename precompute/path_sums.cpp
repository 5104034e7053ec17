// What the paths of a tile bring: columns of the sky, until they are rows and their noise is known.

#include "precompute/path_sums.h"

#include <algorithm>

namespace haarlight {
namespace {

// So many columns, 6 MB at 64x64 faces, wait for one pass over the sums, which are as many bytes.
constexpr std::size_t kColumnsAtOnce = 4096;

float channel(const RgbD& c, std::size_t i) {
  return static_cast<float>(i == 0 ? c.r : i == 1 ? c.g : c.b);
}

}  // namespace

void PathSums::begin(const IndirectSky& sky) {
  sky_ = &sky;
  slots_ = sky.slots();
  light_count_ = sky.lights();
  paths_.clear(), lights_.clear(), bases_.clear(), columns_.clear(), deposits_.clear();
  first_of_batch_ = 0;
  sums_.assign(kOut * sky.row_size(), 0.0f);
  deposit_at_.assign(static_cast<std::size_t>(sky.layout().size()), 0);
  deposit_texel_.clear(), deposited_.clear();
  direct_.assign(light_count_ * kOut, 0.0f);
  sum_.assign(light_count_ * kOut, 0.0);
  square_.assign(light_count_ * kOut, 0.0);
  of_phase_.resize(sky.phases());
}

void PathSums::add_direct(std::size_t out, const float* texels) {
  thread_local std::vector<float> picture;
  picture.assign(light_count_, 0.0f);
  sky_->add_picture(texels, picture.data());
  for (std::size_t l = 0; l < light_count_; ++l) direct_[l * kOut + out] = picture[l];
}

std::int32_t PathSums::add_path(int part, std::size_t row, const RgbD& weight) {
  Path path;
  path.row = static_cast<std::int32_t>(row);
  path.part = part;
  path.own = weight;
  paths_.push_back(path);
  lights_.resize(lights_.size() + 3 * light_count_, 0.0f);
  return static_cast<std::int32_t>(paths_.size()) - 1;
}

std::int32_t PathSums::add_shared_path(int part) {
  const std::int32_t number = add_path(part, 0, {});
  paths_.back().row = kShared;
  paths_.back().base = bases_.size();
  bases_.resize(bases_.size() + kOut, 0.0f);
  return number;
}

std::size_t PathSums::add_column(std::int32_t path, int phase, const RgbD& tint,
                                 std::uint64_t packets) {
  columns_.push_back({path, phase, tint, packets});
  if (values_.size() < columns_.size() * slots_) values_.resize(columns_.size() * slots_ * 3 / 2);
  return columns_.size() - 1;
}

void PathSums::close_column(std::size_t column) {
  const Column& c = columns_[column];
  const SparseColumn seen{values(column), c.packets};
  float* to = light(c.path);
  const float* of = sky_->light_of(static_cast<std::size_t>(c.phase));
  thread_local std::vector<float> sums;
  sums.assign(light_count_, 0.0f);
  add_dot_products(seen, of, light_count_, sums.data());
  for (std::size_t i = 0; i < 3; ++i) {
    const float tint = channel(c.tint, i);
    for (std::size_t l = 0; l < light_count_; ++l) to[i * light_count_ + l] += tint * sums[l];
  }
}

void PathSums::add_deposit(std::int32_t path, std::size_t texel, const RgbD& tint) {
  deposits_.push_back({path, texel, tint});
  float* to = light(path);
  const float* of = sky_->light_in(texel);
  for (std::size_t i = 0; i < 3; ++i) {
    const float t = channel(tint, i);
    for (std::size_t l = 0; l < light_count_; ++l) to[i * light_count_ + l] += t * of[l];
  }
}

void PathSums::end_batch(int paths, int done, TileNoise& noise) {
  judge(paths, done, noise);
  first_of_batch_ = paths_.size();
  if (columns_.size() >= kColumnsAtOnce) finish();
}

// The pictures that each part of the batch gives under the built-in lightings: their spread is the
// noise of a part, and that of the mean of all parts so far smaller by their number.
void PathSums::judge(int paths, int done, TileNoise& noise) {
  for (int part = 0; part < kParts; ++part) {
    part_sum_.assign(light_count_ * kOut, 0.0f);
    for (std::size_t c = 0; c < 3; ++c) {
      path_lights_.clear();
      for (std::size_t i = first_of_batch_; i < paths_.size(); ++i) {
        const Path& path = paths_[i];
        if (path.part != part) continue;
        const float* of = light(static_cast<std::int32_t>(i)) + c * light_count_;
        if (path.row == kShared) {
          path_lights_.push_back({bases_.data() + path.base + c * kRows, of});
          continue;
        }
        float* to = part_sum_.data() + c * kRows + static_cast<std::size_t>(path.row);
        const float weight = channel(path.own, c);
        for (std::size_t l = 0; l < light_count_; ++l) to[l * kOut] += weight * of[l];
      }
      add_light_products(path_lights_, kRows, light_count_, part_sum_.data() + c * kRows, kOut);
    }
    for (std::size_t m = 0; m < sum_.size(); ++m) {
      const double mean = static_cast<double>(part_sum_[m]) * kParts / paths;
      sum_[m] += mean;
      square_[m] += mean * mean;
    }
  }
  const double parts = static_cast<double>(done) * kParts / paths;
  noise.variance.assign(light_count_, 0.0);
  noise.energy.assign(light_count_, 0.0);
  for (std::size_t l = 0; l < light_count_; ++l) {
    for (std::size_t m = 0; m < kOut; ++m) {
      const std::size_t i = l * kOut + m;
      const double mean = sum_[i] / parts;
      noise.variance[l] += std::max(0.0, square_[i] / parts - mean * mean) / (parts - 1);
      const double value = static_cast<double>(direct_[i]) + mean;
      noise.energy[l] += value * value;
    }
  }
  noise.paths = done;
}

void PathSums::finish() {
  apply();
  apply_deposits();
  paths_.clear(), lights_.clear(), bases_.clear(), columns_.clear(), deposits_.clear();
  first_of_batch_ = 0;
}

void PathSums::apply() {
  for (auto& list : of_phase_) list.clear();
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const Column& column = columns_[k];
    if (is_shared(column.path)) {
      of_phase_[static_cast<std::size_t>(column.phase)].push_back(k);
      continue;
    }
    const Path& path = paths_[at(column.path)];
    const RgbD weight = path.own * column.tint;
    for (std::size_t c = 0; c < 3; ++c) {
      float* sum = sums_.data() +
                   (c * kRows + static_cast<std::size_t>(path.row)) * sky_->row_size() +
                   static_cast<std::size_t>(column.phase) * slots_;
      add_scaled({values(k), column.packets}, channel(weight, c), sum);
    }
  }
  for (std::size_t phase = 0; phase < of_phase_.size(); ++phase) {
    sparse_.clear();
    weights_.resize(of_phase_[phase].size() * kOut);
    float* to = weights_.data();
    for (const std::size_t k : of_phase_[phase]) {
      const Column& column = columns_[k];
      sparse_.push_back({values(k), column.packets});
      const float* base = weights(column.path);
      for (std::size_t c = 0; c < 3; ++c) {
        const float tint = channel(column.tint, c);
        for (std::size_t row = 0; row < kRows; ++row) *to++ = tint * *base++;
      }
    }
    add_row_products(weights_.data(), sparse_, kOut, slots_, sums_.data() + phase * slots_,
                     sky_->row_size());
  }
}

void PathSums::apply_deposits() {
  for (const Deposit& d : deposits_) {
    std::uint32_t& place = deposit_at_[d.texel];
    if (place == 0) {
      deposit_texel_.push_back(d.texel);
      deposited_.resize(deposited_.size() + kOut, 0.0f);
      place = static_cast<std::uint32_t>(deposit_texel_.size());
    }
    const Path& path = paths_[at(d.path)];
    float* sum = deposited_.data() + (std::size_t{place} - 1) * kOut;
    const float* base = path.row == kShared ? weights(d.path) : nullptr;
    for (std::size_t c = 0; c < 3; ++c, sum += kRows) {
      const float tint = channel(d.tint, c);
      if (!base) {
        sum[path.row] += channel(path.own, c) * tint;
        continue;
      }
      for (std::size_t row = 0; row < kRows; ++row) sum[row] += tint * base[c * kRows + row];
    }
  }
}

void PathSums::add_to(std::size_t out, float scale, float* texels) const {
  sky_->add_sums(sums_.data() + out * sky_->row_size(), scale, texels);
  for (std::size_t place = 0; place < deposit_texel_.size(); ++place) {
    texels[deposit_texel_[place]] += scale * deposited_[place * kOut + out];
  }
}

}  // namespace haarlight
