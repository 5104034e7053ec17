// haarlight-study: numbers for bench/curves.py that `haarlight relight` does not print.

#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "prt/lighting_tracker.h"
#include "prt/motion.h"
#include "prt/sh_relighter.h"

namespace haarlight::bench {

struct StudyOptions {
  std::filesystem::path env, env_to, output;
  MotionOptions motion;
  int frames = 130;
};

/// Metrics as relight's, method "sh5" or "sh5i" (incremental), against the exact picture; pictures
/// of `save` frames as frame_0000.exr in `folder`.
void study_sh(const StudyOptions& options, const std::filesystem::path& transport,
              const ShOptions& sh, const std::filesystem::path& folder,
              const std::vector<int>& save);

/// Which wavelets a method chooses: a row a frame and band with the number chosen, and, for the
/// frames in `maps`, how many of the chosen wavelets lie over each texel (frame, face, y, x, count;
/// zeros are left out), in OUTPUT.map.csv. Overbeck 2006, Figure 4.
void study_chosen(const StudyOptions& options, int face, const LightingOptions& lighting,
                  const std::vector<int>& maps);

/// Energy of the lighting by spatial and temporal wavelet band over 128 frames: a row a pair.
/// Overbeck 2006, Figure 5. Temporal band 0 is the mean, band b >= 1 wavelets of 128 / 2^(b-1)
/// frames.
void study_energy(const StudyOptions& options, int face);

/// A row a frame of `milliseconds` each: its metrics, for how long threads that could have run
/// waited for a core meanwhile, how often they were taken off one, what the host took for itself;
/// and how long kAgain runs took that were made to do the same work, bit for bit. A frame that is
/// late and whose work is not when it is done again was held up from outside.
void study_budget(const StudyOptions& options, const std::filesystem::path& transport,
                  double milliseconds);
inline constexpr std::size_t kAgain = 3;

/// A picture's transport at `bits` an entry (2 to 8), a scale a block as it is: a row a frame with
/// the bytes of the file and those it would have, the entries that are not zero then, and relative
/// RMS errors against all coefficients as stored: of all coefficients, and of the 40, 100 and 200
/// largest by area (Ng 2003), at `bits` and as stored.
void study_bits(const StudyOptions& options, const std::filesystem::path& transport, int bits);

/// Bounds of the error of a picture's transport from norms over so many rows each, relative as the
/// error is, by NWA and PBI of 30 and 100 wavelets in every 35th frame; in green, what largest
/// singular values of bands would make of them (approached from below: no bound).
void study_norms(const StudyOptions& options, const std::filesystem::path& transport);

void write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace haarlight::bench
