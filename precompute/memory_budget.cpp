// How much memory there is, and how many workers fit.

#include "precompute/memory_budget.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <string>

#include "core/error.h"

namespace haarlight {
namespace {

std::optional<std::uint64_t> number_in(const char* file) {
  std::ifstream stream(file);
  std::uint64_t value = 0;
  if (stream >> value) return value;  // not "max"
  return std::nullopt;
}

std::optional<std::uint64_t> available_in_meminfo() {
  std::ifstream stream("/proc/meminfo");
  std::string name, unit;
  for (std::uint64_t value = 0; stream >> name >> value; std::getline(stream, unit)) {
    if (name == "MemAvailable:") return value * 1024;
  }
  return std::nullopt;
}

std::uint64_t page_size() {
  const long size = ::sysconf(_SC_PAGESIZE);
  return size > 0 ? static_cast<std::uint64_t>(size) : 4096;
}

}  // namespace

std::uint64_t free_memory() {
  std::uint64_t bytes = 0;
  if (const auto available = available_in_meminfo()) {
    bytes = *available;
  } else {
    const long pages = ::sysconf(_SC_AVPHYS_PAGES);
    if (pages > 0) bytes = static_cast<std::uint64_t>(pages) * page_size();
  }
  const auto most = number_in("/sys/fs/cgroup/memory.max");
  const auto current = number_in("/sys/fs/cgroup/memory.current");
  if (most && current) bytes = std::min(bytes, *most - std::min(*most, *current));
  return bytes;
}

std::uint64_t used_memory() {
  std::ifstream stream("/proc/self/statm");
  std::uint64_t size = 0, resident = 0;
  return stream >> size >> resident ? resident * page_size() : 0;
}

int workers_that_fit(std::uint64_t memory, std::uint64_t used, std::uint64_t worker_bytes,
                     int threads) {
  if (memory == 0) {
    const std::uint64_t free = free_memory();
    if (free == 0) return threads;
    memory = used + free / 2;
  }
  if (used + worker_bytes > memory) {
    constexpr double kMebi = 1024.0 * 1024.0;
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("memory of {:.0f} MiB is too little, expected at least {:.0f} MiB: "
                    "{:.0f} for the scene and {:.0f} for one thread",
                    static_cast<double>(memory) / kMebi,
                    static_cast<double>(used + worker_bytes) / kMebi + 0.5,
                    static_cast<double>(used) / kMebi, static_cast<double>(worker_bytes) / kMebi));
  }
  const std::uint64_t fit = (memory - used) / std::max<std::uint64_t>(1, worker_bytes);
  return static_cast<int>(std::min<std::uint64_t>(fit, static_cast<std::uint64_t>(threads)));
}

}  // namespace haarlight
