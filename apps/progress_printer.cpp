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

void ProgressPrinter::set_rate(double count, double seconds, const std::string& unit) {
  if (!(seconds > 0)) return;
  const double rate = count / seconds;
  rate_ = rate >= 1e6   ? fmt::format(", {:.1f} M{}/s", rate * 1e-6, unit)
          : rate >= 1e3 ? fmt::format(", {:.1f} k{}/s", rate * 1e-3, unit)
                        : fmt::format(", {:.0f} {}/s", rate, unit);
}

bool ProgressPrinter::operator()(double share) {
  const auto now = std::chrono::steady_clock::now();
  const double seconds = std::chrono::duration<double>(now - begin_).count();
  if (begin_share_ < 0) begin_share_ = share;
  int percent = static_cast<int>(100.0 * std::clamp(share, 0.0, 1.0));
  if (!terminal_) percent -= percent % 10;
  if (percent > last_percent_ && (terminal_ || percent > 0)) {
    const double done = share - begin_share_;
    const std::string left =
        done > 0 && share < 1 ? fmt::format(", {:.0f} s left", seconds * (1 - share) / done) : "";
    if (terminal_) {
      const int filled = percent * kBarWidth / 100;
      fmt::print(stderr, "\r{} [{:<{}}] {:3} %{}{}\033[K", label_,
                 std::string(static_cast<std::size_t>(filled), '#'), kBarWidth, percent, rate_,
                 left);
      bar_drawn_ = true;
    } else {
      fmt::print(stderr, "{}: {} %, {:.0f} s{}{}\n", label_, percent, seconds, rate_, left);
    }
    std::fflush(stderr);
    last_percent_ = percent;
  }
  return !interrupted();
}

}  // namespace haarlight
