// Decides, applies, finishes, measures.

#include "prt/frame_relighter.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/image_metrics.h"
#include "prt/completeness.h"
#include "prt/error_limit.h"

namespace haarlight {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

LightingOptions with_weights(LightingOptions lighting, WaveletWeight weight,
                             const Transport& transport) {
  lighting.weights = wavelet_weights(weight, transport);
  return lighting;
}

double picture_norm(const Image& picture) {
  double sum = 0;
  for (const Rgb& p : picture.pixels) {
    const RgbD d(p);
    sum += d.r * d.r + d.g * d.g + d.b * d.b;
  }
  return std::sqrt(sum);
}

// What streaming columns is like, in bytes: a column is a run in each chunk, and to begin one takes
// as long as to read a kilobyte.
double cost(std::uint64_t bytes, std::uint64_t runs) {
  return static_cast<double>(bytes) + 1024 * static_cast<double>(runs);
}

std::vector<double> column_costs(const Transport& transport, const RowSums* sums) {
  std::vector<double> costs(static_cast<std::size_t>(transport.layout().size()));
  for (std::size_t j = 0; j < costs.size(); ++j) {
    const int index = static_cast<int>(j);
    costs[j] = cost(transport.column_bytes(index), sums ? sums->column_runs(index) : 0);
  }
  return costs;
}

}  // namespace

FrameRelighter::FrameRelighter(const Transport& transport, LightingOptions lighting,
                               WaveletWeight weight, RelighterFactory make)
    : tracker_(transport.layout(), with_weights(std::move(lighting), weight, transport)),
      weight_(weight),
      make_(std::move(make)),
      relighter_(make_relighter(make_, transport)) {
  relighter_->expect_resets(tracker_.options().method == LightingMethod::pbi);
  transport_error_ = measured_error(transport.info().meta);
}

void FrameRelighter::set_options(const LightingOptions& lighting, WaveletWeight weight) {
  const LightingOptions& now = tracker_.options();
  if (lighting.method == now.method && lighting.wavelets == now.wavelets &&
      lighting.band_choice == now.band_choice && weight == weight_) {
    return;
  }
  if (weight == weight_) {
    LightingOptions options = now;
    options.method = lighting.method;
    options.wavelets = lighting.wavelets;
    options.band_choice = lighting.band_choice;
    tracker_.set_options(std::move(options));
  } else {
    tracker_.set_options(with_weights(lighting, weight, transport()));
    weight_ = weight;
  }
  relighter_->expect_resets(tracker_.options().method == LightingMethod::pbi);
}

void FrameRelighter::compare_with_reference(bool compare) {
  compare_ = compare;
  if (!compare || exact_) return;
  LightingOptions exact;
  exact.method = LightingMethod::reference;
  exact_.emplace(
      Exact{LightingTracker(transport().layout(), exact), make_relighter(make_, transport())});
  exact_->relighter->set_exact(true);
  exact_->relighter->expect_resets(false);
}

const Image* FrameRelighter::reference() const {
  return compare_ && exact_ ? &exact_->relighter->picture() : nullptr;
}

// A black target under the reference method takes everything back, and leaves sums of exactly 0.
void FrameRelighter::go_dark() {
  const LightingOptions options = tracker_.options();
  LightingOptions all = options;
  all.method = LightingMethod::reference;
  tracker_.set_options(std::move(all));
  relighter_->set_exact(true);
  relighter_->apply(
      tracker_.advance(std::vector<Rgb>(static_cast<std::size_t>(transport().layout().size()))));
  tracker_.set_options(options);
}

bool FrameRelighter::can_judge() const { return relighter_->shows_rows(); }

void FrameRelighter::set_budget(const FrameBudget& budget) {
  if (budget.kind != BudgetKind::wavelets && !(budget.value > 0 && std::isfinite(budget.value))) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("a budget of {}, expected a finite number above 0", budget.value));
  }
  if (budget.kind == BudgetKind::error && !can_judge()) {
    throw Error(ErrorKind::invalid_argument,
                "an error as budget, expected a renderer whose picture's error can be estimated");
  }
  budget_ = budget;
}

ErrorJudge& FrameRelighter::estimator() {
  if (!errors_) errors_ = make_error_judge(transport());
  return *errors_;
}

// A frame under a time begins: what it would move beside columns.
void FrameRelighter::start_clock(Clock::time_point begin) {
  const RowSums* sums = relighter_->row_sums();
  reset_bytes_.resize(static_cast<std::size_t>(transport().layout().band_count()));
  for (std::size_t b = 0; b < reset_bytes_.size(); ++b) {
    const int band = static_cast<int>(b);
    reset_bytes_[b] = sums ? cost(sums->reset_bytes(band), sums->reset_runs(band)) : 0;
  }
  time_->start(budget_.value, begin, reset_bytes_,
               sums ? cost(sums->fold_bytes(), sums->fold_runs()) : 0, relighter_->takes_parts());
}

// What vertices weigh in the picture from where the camera is, which the relighter has looked from.
void FrameRelighter::know_view() {
  if (transport().kind() == TransportKind::image || judged_from_ == relighter_->camera()) return;
  relighter_->vertex_weights(vertex_weights_);
  estimator().look({vertex_weights_, relighter_->view_factors()});
  judged_from_ = relighter_->camera();
}

void FrameRelighter::judge(std::span<const Rgb> target) {
  metrics_.error_estimate.reset();
  metrics_.error_bound.reset();
  if (!(judge_ || budget_.kind == BudgetKind::error) || !can_judge()) return;
  know_view();
  ErrorJudge& errors = estimator();
  relighter_->pending_rows(pending_);
  errors.set_pending(pending_);
  const PictureErrorGuess guess =
      errors.judge(target, tracker_.shown(), picture_norm(relighter_->picture()));
  metrics_.error_estimate = guess.estimate;
  metrics_.error_bound = guess.bound;
}

void FrameRelighter::follow_flicker() {
  const Image& picture = relighter_->picture();
  const Image& exact = exact_->relighter->picture();
  const bool first = !compared_before_ || picture_before_.pixels.size() != picture.pixels.size();
  double difference = 0, norm = 0;
  for (std::size_t i = 0; !first && i < picture.pixels.size(); ++i) {
    const RgbD r(exact.pixels[i]);
    const RgbD d = (RgbD(picture.pixels[i]) - RgbD(picture_before_.pixels[i])) -
                   (r - RgbD(reference_before_.pixels[i]));
    difference += d.r * d.r + d.g * d.g + d.b * d.b;
    norm += r.r * r.r + r.g * r.g + r.b * r.b;
  }
  metrics_.flicker = difference > 0 ? std::sqrt(difference / norm) : 0;
  picture_before_ = picture;
  reference_before_ = exact;
}

// Decides which wavelets change, streams their columns and makes the picture, in one part or two.
RelightStats FrameRelighter::go(std::span<const Rgb> target, FrameStart start, BudgetKind kind,
                                const std::optional<FrameCourse>& repeated) {
  const LightingOptions& lighting = tracker_.options();
  const bool limited = start != FrameStart::exact && lighting.method != LightingMethod::reference;
  const bool timed = kind == BudgetKind::milliseconds;
  relighter_->keep_logs_short(timed || (repeated && repeated->timed));
  if (kind == BudgetKind::error) estimator();
  if (timed && !time_) time_.emplace(column_costs(transport(), relighter_->row_sums()));

  const Clock::time_point begin = Clock::now();
  if (kind == BudgetKind::error && judged_from_ != relighter_->camera()) {
    // A relighter looks when it applies, whatever that changes.
    relighter_->set_exact(true);
    relighter_->apply({});
    know_view();
  }
  std::optional<ErrorLimit> error;
  std::optional<CourseLimit> course;
  UpdateLimit* limit = nullptr;
  if (timed) {
    start_clock(begin);
    limit = &*time_;
  } else if (kind == BudgetKind::error) {
    limit = &error.emplace(*errors_, budget_.value);
  } else if (repeated && repeated->timed) {
    limit = &course.emplace(*repeated, lighting.wavelets);
  }
  const LightingUpdate& update = start == FrameStart::exact ? tracker_.start_exact(target)
                                 : limit && limited         ? tracker_.advance(target, *limit)
                                                            : tracker_.advance(target);
  metrics_.update_ms = milliseconds(begin, Clock::now());
  metrics_.course = repeated.value_or(FrameCourse{timed, 0, {}});
  relighter_->set_exact(!limited || kind == BudgetKind::error);
  update_.reset = update.reset;
  update_.deltas.assign(update.deltas.begin(), update.deltas.end());

  const bool parts = limited && relighter_->takes_parts() && !update.empty() &&
                     (timed || (course && repeated->first > 0));
  RelightStats stats, first;
  if (parts) {
    first = relighter_->apply_first(update);
    const Clock::time_point resumed = Clock::now();
    if (timed) time_->resume();
    if (course) course->resume();
    const LightingUpdate& rest = tracker_.extend(*limit);
    metrics_.update_ms += milliseconds(resumed, Clock::now());
    stats = relighter_->apply(rest);
    update_.deltas.insert(update_.deltas.end(), rest.deltas.begin(), rest.deltas.end());
  } else {
    stats = relighter_->apply(update);
  }
  metrics_.total_ms = milliseconds(begin, Clock::now());
  stats.add(first);
  if (timed && limited) {
    time_->finish(metrics_.total_ms);
    metrics_.course.put_off = time_->put_off();
    if (update_.deltas.size() > update.deltas.size()) {
      metrics_.course.first = static_cast<int>(update.deltas.size());
    }
  }
  std::sort(update_.deltas.begin(), update_.deltas.end(),
            [](const WaveletDelta& a, const WaveletDelta& b) { return a.index < b.index; });
  return stats;
}

const FrameMetrics& FrameRelighter::relight(std::span<const Rgb> target, FrameStart start,
                                            int frame) {
  if (start == FrameStart::dark) go_dark();
  const HaarLayout& layout = transport().layout();
  const LightingOptions& lighting = tracker_.options();

  const std::optional<FrameCourse> course = std::exchange(repeat_, std::nullopt);
  const BudgetKind kind = course ? BudgetKind::wavelets : budget_.kind;
  const RelightStats stats = go(target, start, kind, course);

  metrics_.frame = frame;
  metrics_.method = lighting.method;
  metrics_.wavelets = lighting.method == LightingMethod::reference ? layout.size()
                      : kind == BudgetKind::wavelets               ? lighting.wavelets
                                                     : static_cast<int>(update_.deltas.size());
  metrics_.weight = weight_;
  metrics_.updates = static_cast<int>(update_.deltas.size());
  metrics_.resets.clear();
  for (int b = 0; b < layout.band_count(); ++b) {
    metrics_.resets += update_.reset[static_cast<std::size_t>(b)] ? '1' : '0';
  }
  metrics_.lighting_error = lighting_error(layout, tracker_.shown(), target);
  metrics_.apply_ms = stats.apply_ms;
  metrics_.finish_ms = stats.finish_ms;
  metrics_.bytes = stats.apply.transport_bytes + stats.apply.sum_bytes;

  // The same frame under the exact lighting. Both pictures are black where the scene is not, so
  // sums over all pixels are sums over the scene's.
  metrics_.image_rel_rmse.reset();
  metrics_.image_max_abs.reset();
  metrics_.flicker.reset();
  metrics_.transport_error = transport_error_;
  judge(target);
  if (compare_ && exact_) {
    exact_->relighter->set_camera(relighter_->camera());
    exact_->relighter->apply(exact_->tracker.advance(target));
    const ImageDifference difference =
        compare_images(relighter_->picture(), exact_->relighter->picture());
    metrics_.image_rel_rmse = difference.relative_rmse;
    metrics_.image_max_abs = difference.max_abs;
    follow_flicker();
  }
  compared_before_ = compare_;
  return metrics_;
}

}  // namespace haarlight
