// Ratios of full light transport, and of whole runs.

#include <fmt/format.h>

#include <string>

#include "bench/summary.h"

namespace haarlight::bench {
namespace {

const char* verdict(bool met) { return met ? "met" : "MISSED"; }

}  // namespace

void Collector::print_light() const {
  const Case* tiles = find("light.tiles");
  const Case* bare = find("light.bare.paths");
  if (tiles && bare) {
    const double ratio = bare->milliseconds / tiles->milliseconds;
    const double rate = tiles->counters.at("items_per_second") / 1e6;
    fmt::print(
        "  full light: {:.1f} M rays/s, {:.0f} % of a bare loop over the same rays at {:.1f} M/s "
        "(wanted 60 % or more: {})\n",
        rate, 100 * ratio, bare->counters.at("items_per_second") / 1e6, verdict(ratio >= 0.6));
    if (const Case* loop = find("light.path.loop")) {
      const double theirs = loop->counters.at("items_per_second") / 1e6;
      fmt::print("  full light: {:.2f} times the rays of a plain path loop at {:.1f} M/s\n",
                 rate / theirs, theirs);
    }
  }
  for (const char* kind : {"direct", "full"}) {
    const Case* one = find(fmt::format("run.{}.t1", kind));
    const Case* two = find(fmt::format("run.{}.t2", kind));
    if (const Case* run = two ? two : one) {
      const double haar = run->counters.at("haar"), quantise = run->counters.at("quantise"),
                   write = run->counters.at("write");
      const double share = haar + quantise + write;
      fmt::print(
          "  whole run, {:<6} Haar {:.1f} %, quantisation {:.1f} %, writing {:.1f} %: {:.1f} % "
          "(wanted under 25 %: {})\n",
          fmt::format("{}:", kind), 100 * haar, 100 * quantise, 100 * write, 100 * share,
          verdict(share < 0.25));
    }
    if (one && two) {
      const double speedup = one->milliseconds / two->milliseconds;
      fmt::print(
          "  whole run, {:<6} {:.2f} s on 1 thread, {:.2f} s on 2: {:.2f} times as fast "
          "(wanted 1.8 or more: {})\n",
          fmt::format("{}:", kind), one->milliseconds / 1e3, two->milliseconds / 1e3, speedup,
          verdict(speedup >= 1.8));
    }
  }
}

}  // namespace haarlight::bench
