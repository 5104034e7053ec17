// The larger scenes that move, each into a writer; see animations.h for what they are.

#pragma once

#include "data_gen/animated_writer.h"
#include "data_gen/animations.h"

namespace haarlight::data_gen {

void add_cornell_bunny(AnimatedWriter& writer, const AnimationOptions& options);
void add_wobble(AnimatedWriter& writer);
void add_bunnies(AnimatedWriter& writer, const AnimationOptions& options);
void add_flying_kite(AnimatedWriter& writer);
void add_interior(AnimatedWriter& writer);
void add_desk(AnimatedWriter& writer);
void add_office(AnimatedWriter& writer);

}  // namespace haarlight::data_gen
