// Decides, frame by frame, which wavelets of the light change and by how much: NWA, BI and PBI
// (Overbeck, Ben-Artzi, Ramamoorthi, Grinspun 2006, "Exploiting Temporal Coherence for Incremental
// All-Frequency Relighting"). Knows nothing of pixels, vertices or clusters.

#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prt/lighting_update.h"
#include "prt/update_limit.h"
#include "wavelet/haar.h"
#include "wavelet/top_k.h"

namespace haarlight {

enum class LightingMethod {
  nwa,        ///< non-linear approximation of the frame itself (Ng 2003): every band is reset
  bi,         ///< basic incremental: approximate the change since what is shown (section 3)
  pbi,        ///< per-band incremental: each band whichever promises less error (section 5)
  reference,  ///< every changed coefficient, whatever the number: exact
};

/// How PBI decides which bands to reset.
enum class BandChoice {
  simple,      ///< band by band: keep it when ||L_new - L_shown||_1 < ||L_new||_1 (section 5.2.2)
  exhaustive,  ///< all 2^N combinations, least weighted error after the update (section 5.2.1); the
               ///< baseline that `simple` is compared with
};

struct LightingOptions {
  LightingMethod method = LightingMethod::pbi;
  int wavelets = 30;           ///< most deltas in one update, >= 1; ignored by `reference`
  std::vector<float> weights;  ///< importance of a unit of each orthonormal coefficient, finite and
                               ///< >= 0, layout.size() of them; empty = area_weights()
  BandChoice band_choice = BandChoice::simple;
};

std::optional<LightingMethod> lighting_method_from_name(std::string_view name);
std::string lighting_method_name(LightingMethod method);

/// sqrt(area) of each wavelet in texels. Ng 2003 ranks by area x |unnormalised coefficient|; an
/// orthonormal coefficient is sqrt(area) times the unnormalised one, which leaves sqrt(area).
std::vector<float> area_weights(const HaarLayout& layout);

/// Turns target lightings into updates. Let L be the target of a frame and S = shown() what every
/// consumer holds. Per band b the work is on
///   D_b = L_b - S_b  (keep the band: Eqs. 5, 6)   or   D_b = L_b  (reset it: Eq. 2),
/// and the update takes the `wavelets` entries of D with the largest weight * |D| (L1 over the
/// three channels), over all bands together. nwa resets every band, bi none, pbi those for which
/// the weighted || L_b ||_1 <= || L_b - S_b ||_1; a band with nothing shown needs no reset.
/// Entries that are already right are never spent on, so a still light is reached exactly after at
/// most size / wavelets frames and from then on updates are empty.
///
/// Invariant of every consumer: picture == T * shown().
class LightingTracker {
 public:
  /// Starts dark: shown() is all zero. Throws Error{invalid_argument} naming the option that is
  /// out of range.
  LightingTracker(const HaarLayout& layout, LightingOptions options);

  /// The update for the next frame; valid until the next call (its memory is reused). `target` is
  /// layout.size() coefficients, all finite, magnitude up to 1.8e18 * face_size (what a sky of the
  /// largest radiance has); otherwise throws Error{invalid_argument} and leaves the tracker as it
  /// was. Magnitudes below 2^-100 are taken as zero. O(size()); no heap use once warm.
  const LightingUpdate& advance(std::span<const Rgb> target);

  /// The same, with as many wavelets as `limit` takes instead of options().wavelets. The first n of
  /// the ranking are those that advance() chooses for wavelets = n (and simple band choice).
  const LightingUpdate& advance(std::span<const Rgb> target, UpdateLimit& limit);

  /// More of the same frame: goes on in the ranking where the last advance() under a limit, or the
  /// last extend() after it, was told no. Returns the further deltas, without resets; valid until
  /// the next call. What advance() returned stays as it is.
  const LightingUpdate& extend(UpdateLimit& limit);

  /// Shows `target` in full, as at the start of a sequence (Overbeck 2006, section 3, sets
  /// L~0 = L0): every band reset, every non-zero coefficient in the update. Same errors.
  const LightingUpdate& start_exact(std::span<const Rgb> target);

  /// Changes the budget or method from the next frame on. Throws as the constructor does, and then
  /// keeps the old options.
  void set_options(LightingOptions options);

  const LightingOptions& options() const { return options_; }
  const HaarLayout& layout() const { return layout_; }
  std::span<const Rgb> shown() const { return shown_; }

 private:
  const LightingUpdate& advance(std::span<const Rgb> target, UpdateLimit* limit);
  std::span<const Rgb> take_in(std::span<const Rgb> target);
  void rank(std::span<const Rgb> target);
  BandMask choose_bands_simply() const;
  BandMask choose_bands_exhaustively(int wavelets);
  void take_ranked(std::span<const Rgb> target, UpdateLimit& limit);
  void show(std::span<const Rgb> target, int index, LightingUpdate& update);

  HaarLayout layout_;
  LightingOptions options_;
  std::vector<float> weights_;
  std::vector<Rgb> target_;  // of the frame, checked
  std::vector<Rgb> shown_;
  std::vector<RgbD>
      emitted_;  // sum of all deltas since the band was last reset, as consumers have it
  LightingUpdate update_, rest_;
  int next_ranked_ = -1;  // the next to be asked for; -1: there is none

  // Scratch of one frame, all reused.
  std::vector<float> keep_key_, reset_key_;  // weight * |D| for either choice
  std::array<double, HaarLayout::kMaxBands> keep_norm_{}, reset_norm_{}, shown_norm_{};
  std::vector<float> key_;  // of the choice made
  std::vector<int> chosen_;
  TopK top_k_;
  RankedKeys ranked_;
  std::vector<std::vector<float>> sorted_keys_;  // exhaustive: [band * 2 + choice], descending
  std::vector<int> band_chosen_;
};

/// Area-weighted L1 difference relative to the area-weighted L1 norm of the target, over all
/// channels: the error that Overbeck 2006, Figure 7 plots. 0 when both are black, and 1 for
/// something shown under a black target.
double lighting_error(const HaarLayout& layout, std::span<const Rgb> shown,
                      std::span<const Rgb> target);

}  // namespace haarlight
