// A run shared by the processes that mpirun started. The only place that touches MPI.

#include "apps/mpi_distribution.h"

#include <cstdlib>
#include <string>

#include "core/error.h"

#ifdef HAARLIGHT_WITH_MPI
#include <fmt/format.h>
#include <mpi.h>

#include <chrono>
#include <climits>
#include <mutex>
#include <thread>
#include <vector>
#endif

namespace haarlight {
namespace {

// Set by Open MPI, and by MPICH and what descends from it, for the processes they start.
int started_processes() {
  for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    if (const char* value = std::getenv(name)) return std::atoi(value);
  }
  return 1;
}

#ifdef HAARLIGHT_WITH_MPI

// Messages to the leader: a finished tile (or none) with the wish for another; a failure.
constexpr int kExchangeTag = 1, kFailureTag = 2;
// From the leader: a tile's number, or that nothing is left.
constexpr int kTileTag = 3;
constexpr int kNothing = -1;

void check(int code, const char* what) {
  if (code != MPI_SUCCESS) throw Error(ErrorKind::io, fmt::format("MPI: cannot {}", what));
}

int count_of(std::size_t bytes) {
  if (bytes > INT_MAX) throw Error(ErrorKind::io, "MPI: a message of more than 2 GiB");
  return static_cast<int>(bytes);
}

// After start-up one thread of a process at a time is inside MPI: the leader's serving thread, and
// elsewhere whoever holds the mutex.
class MpiDistribution : public Distribution {
 public:
  MpiDistribution() {
    int provided = 0;
    check(MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided), "start");
    if (provided < MPI_THREAD_SERIALIZED) {
      MPI_Finalize();
      throw Error(ErrorKind::io,
                  "MPI: gives no support for threads, expected MPI_THREAD_SERIALIZED");
    }
    MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
    MPI_Comm_size(MPI_COMM_WORLD, &size_);
  }
  ~MpiDistribution() override { MPI_Finalize(); }
  MpiDistribution(const MpiDistribution&) = delete;
  MpiDistribution& operator=(const MpiDistribution&) = delete;

  int rank() const override { return rank_; }
  int size() const override { return size_; }

  std::string agree(const std::string& failure) override {
    const int mine = failure.empty() ? size_ : rank_;
    int first = size_;
    check(MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD), "agree");
    if (first == size_) return {};
    const std::vector<std::byte> text = broadcast_from(first, bytes_of(failure));
    return {reinterpret_cast<const char*>(text.data()), text.size()};
  }

  std::vector<std::byte> broadcast(const std::vector<std::byte>& bytes) override {
    return broadcast_from(0, bytes);
  }

  void serve(const std::function<std::optional<int>()>& next,
             const std::function<void(std::vector<std::byte>)>& take,
             const std::function<void(const std::string&)>& failed,
             const std::function<void()>& idle) override {
    // Every process asks from each of its threads; it says with the failure tag, empty, that the
    // last of them has gone home.
    int at_work = size_ - 1;
    while (at_work > 0) {
      MPI_Status status;
      int there = 0;
      check(MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &status), "listen");
      if (there == 0) {
        // Blocking calls of MPI keep a core busy; tiles take far longer than this.
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        idle();
        continue;
      }
      int size = 0;
      MPI_Get_count(&status, MPI_BYTE, &size);
      std::vector<std::byte> bytes(static_cast<std::size_t>(size));
      check(MPI_Recv(bytes.data(), size, MPI_BYTE, status.MPI_SOURCE, status.MPI_TAG,
                     MPI_COMM_WORLD, MPI_STATUS_IGNORE),
            "receive");
      if (status.MPI_TAG == kFailureTag) {
        --at_work;
        if (size > 0) failed({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        continue;
      }
      if (size > 0) take(std::move(bytes));
      const int tile = next().value_or(kNothing);
      check(MPI_Send(&tile, 1, MPI_INT, status.MPI_SOURCE, kTileTag, MPI_COMM_WORLD), "send");
    }
  }

  std::optional<int> exchange(const std::vector<std::byte>& record) override {
    const std::lock_guard lock(mutex_);
    check(
        MPI_Send(record.data(), count_of(record.size()), MPI_BYTE, 0, kExchangeTag, MPI_COMM_WORLD),
        "send");
    int tile = kNothing;
    check(MPI_Recv(&tile, 1, MPI_INT, 0, kTileTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE), "receive");
    return tile == kNothing ? std::nullopt : std::optional<int>(tile);
  }

  void leave(const std::string& failure) override {
    const std::vector<std::byte> text = bytes_of(failure);
    check(MPI_Send(text.data(), count_of(text.size()), MPI_BYTE, 0, kFailureTag, MPI_COMM_WORLD),
          "send");
  }

 private:
  static std::vector<std::byte> bytes_of(const std::string& text) {
    const auto* begin = reinterpret_cast<const std::byte*>(text.data());
    return {begin, begin + text.size()};
  }

  static std::vector<std::byte> broadcast_from(int root, std::vector<std::byte> bytes) {
    int size = count_of(bytes.size());
    check(MPI_Bcast(&size, 1, MPI_INT, root, MPI_COMM_WORLD), "broadcast");
    bytes.resize(static_cast<std::size_t>(size));
    check(MPI_Bcast(bytes.data(), size, MPI_BYTE, root, MPI_COMM_WORLD), "broadcast");
    return bytes;
  }

  int rank_ = 0, size_ = 1;
  std::mutex mutex_;
};

#endif

}  // namespace

std::unique_ptr<Distribution> start_distribution() {
  if (started_processes() <= 1) return nullptr;
#ifdef HAARLIGHT_WITH_MPI
  return std::make_unique<MpiDistribution>();
#else
  throw Error(ErrorKind::invalid_argument,
              "started as one of several processes by mpirun, but built without MPI: expected a "
              "build with HAARLIGHT_MPI, or one process");
#endif
}

}  // namespace haarlight
