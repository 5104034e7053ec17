// Options of haarlight animate for pictures by virtual lights.

#include "apps/instant_options.h"

#include "apps/option_parsers.h"

namespace haarlight {

void add_instant_options(CLI::App& verb, InstantOptions& options) {
  constexpr int kMostLights = 1 << 16;
  InstantOptions& o = options;
  add_integer(verb, "--vpls", o.lights.count, 1, kMostLights,
              "igi, ic, tic: virtual lights, shared evenly among lamps, shining materials and the "
              "background");
  add_integer(verb, "--bounces", o.lights.bounces, 1, 8,
              "igi, ic, tic: reflections of light before the one that is seen");
  add_number(verb, "--min-distance", o.least_distance, 0, 10,
             "igi, ic, tic: virtual lights nearer than this count less or not at all; of half the "
             "scene's longest edge");
  add_integer(verb, "--pattern", o.pattern, 1, 16,
              "igi: N x N pixels share the virtual lights; 1: all for each");
  add_number(verb, "--cache-radius", o.cache.radius, 0.01, 1,
             "ic, tic: a record is used where distance (of half the scene's longest edge, divided "
             "by --cache-unit) and turn of the normal together are below this");
  add_number(verb, "--cache-unit", o.unit, 0.01, 100,
             "ic, tic: the distance that counts as much as a normal turned by 90 degrees");
  add_number(verb, "--cache-spacing", o.cache.spacing, 0.1, 1,
             "ic, tic: a new record where there is none within this share of the radius");
  add_choice<bool>(verb, "--interpolation", o.cache.fade, {{"faded", true}, {"paper", false}},
                   "ic, tic: paper: weights as they are in equation 5; faded: less what they are "
                   "at a record's edge");
  add_integer(verb, "--max-age", o.cache.oldest, 0, 1'000'000,
              "tic: frames after which a record that nothing used is dropped");
  add_choice<bool>(verb, "--on-moving", o.cache.carry, {{"carry", true}, {"drop", false}},
                   "tic: what becomes of records on bodies that move");
  add_choice<bool>(verb, "--update", o.cache.on_demand, {{"immediate", false}, {"demand", true}},
                   "tic: when rays that changed are traced: at once, or when their record is used");
  add_integer(verb, "--light-points", o.points.light_points, 1, 1 << 12,
              "direct, igi, ic, tic: shadow rays to each shining material, a pixel");
  add_integer(verb, "--lobe-samples", o.points.glossy_samples, 0, 1 << 12,
              "direct, igi, ic, tic: rays of a narrow lobe, a pixel; 0: lobes show lights alone");
}

}  // namespace haarlight
