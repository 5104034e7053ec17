// Pictures of a scene that moves, one after the other, as fast as they come.

#include <fmt/format.h>

#include <chrono>
#include <optional>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "viewer/scene_run.h"

namespace haarlight::viewer {

bool is_scene_file(const std::filesystem::path& file) {
  return file.extension() == ".gltf" || file.extension() == ".glb";
}

void run_scene_headless(const SceneRunOptions& options) {
  using Clock = std::chrono::steady_clock;
  SceneSession session(options.scene, options.settings);
  std::optional<AtomicFile> table;
  const auto write = [&](const std::string& line) { table->write(line.data(), line.size()); };
  if (!options.metrics.empty()) {
    table.emplace(options.metrics);
    write("frame,paths,draw_ms\n");
  }
  session.play(true);
  for (int i = 0; i < options.frames; ++i) {
    if (session.frame() == options.pause_at) session.play(false);
    const auto begin = Clock::now();
    session.advance();
    const std::chrono::duration<double, std::milli> span = Clock::now() - begin;
    if (table) {
      write(fmt::format("{},{},{:.3f}\n", session.frame(), session.samples(), span.count()));
    }
  }
  if (table) table->commit();
  if (!options.exr.empty()) save_image(options.exr, session.picture());
  if (options.screenshot.empty()) return;
  const double exposure = options.exposure_ev.value_or(auto_exposure_ev(session.picture()));
  if (session.shows_life() && !session.life().pixels.empty()) {
    save_image(options.screenshot, session.life());
  } else {
    save_image(options.screenshot, tonemap(session.picture(), {options.curve, exposure}));
  }
}

}  // namespace haarlight::viewer
