// Turns SIGINT and SIGTERM into a flag, and SIGXFSZ into failed writes.

#include "apps/interrupt.h"

#include <csignal>

namespace haarlight {
namespace {

volatile std::sig_atomic_t g_interrupted = 0;

void on_signal(int signal_number) {
  g_interrupted = 1;
  std::signal(signal_number, SIG_DFL);
}

}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  // A file that grows past its limit is an error of the write, not the end.
  std::signal(SIGXFSZ, SIG_IGN);
}

bool interrupted() { return g_interrupted != 0; }

}  // namespace haarlight
