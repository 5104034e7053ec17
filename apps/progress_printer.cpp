// Draws progress on standard error.

#include "apps/progress_printer.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "apps/interrupt.h"

namespace haarlight {
namespace {

constexpr int kBarWidth = 40;

}  // namespace

ProgressPrinter::ProgressPrinter(std::string label)
    : label_(std::move(label)),
      begin_(std::chrono::steady_clock::now()),
      terminal_(::isatty(STDERR_FILENO) == 1) {}

ProgressPrinter::~ProgressPrinter() {
  if (bar_drawn_) std::fputc('\n', stderr);
}

bool ProgressPrinter::operator()(double share) {
  int percent = static_cast<int>(100.0 * std::clamp(share, 0.0, 1.0));
  if (!terminal_) percent -= percent % 10;
  if (percent > last_percent_ && (terminal_ || percent > 0)) {
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    if (terminal_) {
      const int filled = percent * kBarWidth / 100;
      const double left = share > 0 ? seconds * (1 - share) / share : 0;
      fmt::print(stderr, "\r{} [{:<{}}] {:3} %, {:.0f} s left\033[K", label_,
                 std::string(static_cast<std::size_t>(filled), '#'), kBarWidth, percent, left);
      bar_drawn_ = true;
    } else {
      fmt::print(stderr, "{}: {} %, {:.0f} s\n", label_, percent, seconds);
    }
    std::fflush(stderr);
    last_percent_ = percent;
  }
  return !interrupted();
}

}  // namespace haarlight
