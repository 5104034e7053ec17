// A run shared by two processes, here two threads that hand each other messages, one of which
// fails.

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "core/error.h"
#include "precompute/distribution.h"
#include "precompute/tile_run.h"
#include "prt/transport.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

// What two ranks share. Every collective call is a meeting of both.
class Wire {
 public:
  // Both come with a value and leave with both.
  template <typename T>
  std::array<T, 2> meet(int rank, const T& value, std::array<T, 2>& slots) {
    std::unique_lock lock(mutex_);
    slots[static_cast<std::size_t>(rank)] = value;
    const int round = round_;
    if (++waiting_ == 2) {
      waiting_ = 0, ++round_;
      change_.notify_all();
    } else {
      change_.wait(lock, [&] { return round_ != round; });
    }
    return slots;
  }

  struct Message {
    bool last = false;
    std::vector<std::byte> record;
    std::string failure;
  };
  void send(Message message) {
    const std::lock_guard lock(mutex_);
    inbox_.push_back(std::move(message));
    change_.notify_all();
  }
  Message receive() {
    std::unique_lock lock(mutex_);
    change_.wait(lock, [&] { return !inbox_.empty(); });
    Message m = std::move(inbox_.front());
    inbox_.pop_front();
    return m;
  }
  void answer(std::optional<int> tile) {
    const std::lock_guard lock(mutex_);
    answers_.push_back(tile);
    change_.notify_all();
  }
  std::optional<int> answered() {
    std::unique_lock lock(mutex_);
    change_.wait(lock, [&] { return !answers_.empty(); });
    const auto tile = answers_.front();
    answers_.pop_front();
    return tile;
  }

  std::array<std::string, 2> texts;
  std::array<std::vector<std::byte>, 2> bytes;

 private:
  std::mutex mutex_;
  std::condition_variable change_;
  int waiting_ = 0, round_ = 0;
  std::deque<Message> inbox_;
  std::deque<std::optional<int>> answers_;
};

class TwoThreads : public Distribution {
 public:
  TwoThreads(Wire& wire, int rank) : wire_(wire), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return 2; }
  std::string agree(const std::string& failure) override {
    const auto both = wire_.meet(rank_, failure, wire_.texts);
    return both[0].empty() ? both[1] : both[0];
  }
  std::vector<std::byte> broadcast(const std::vector<std::byte>& bytes) override {
    return wire_.meet(rank_, bytes, wire_.bytes)[0];
  }
  void serve(const std::function<std::optional<int>()>& next,
             const std::function<void(std::vector<std::byte>)>& take,
             const std::function<void(const std::string&)>& failed,
             const std::function<void()>&) override {
    for (;;) {
      const Wire::Message m = wire_.receive();
      if (m.last) {
        if (!m.failure.empty()) failed(m.failure);
        return;
      }
      if (!m.record.empty()) take(m.record);
      wire_.answer(next());
    }
  }
  std::optional<int> exchange(const std::vector<std::byte>& record) override {
    wire_.send({false, record, {}});
    return wire_.answered();
  }
  void leave(const std::string& failure) override { wire_.send({true, {}, failure}); }

 private:
  Wire& wire_;
  int rank_;
};

// Random tiles, a little slow, so that both take part; after `good` tiles a worker gives up.
class RandomTiles : public TileSource {
 public:
  explicit RandomTiles(int good) : layout_(4), good_(good) {}
  const HaarLayout& layout() const override { return layout_; }
  std::unique_ptr<Worker> make_worker() const override { return std::make_unique<Own>(*this); }

 private:
  struct Own : Worker {
    explicit Own(const RandomTiles& source) : of(source), left(source.good_) {}
    void trace(std::span<const std::uint32_t> outputs, TileRows& rows) override {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (left-- == 0) throw Error(ErrorKind::io, "the lamp went out");
      std::mt19937_64 random(outputs[0]);
      rows = fixtures::random_tile(of.layout_, random, 0.5, true);
    }
    bool shows_scene(std::span<const std::uint32_t>) override { return true; }
    const RandomTiles& of;
    int left;
  };
  HaarLayout layout_;
  int good_;
};

constexpr int kNever = 1 << 20;

TileRun small_run() {
  TileRun run;
  run.info.face_size = 4;
  run.info.width = run.info.height = 128;
  run.info.camera.width = run.info.camera.height = 128;
  run.fingerprint = "test";
  run.meta = "{}";
  return run;
}

// Leader and follower to their ends: what each threw, or nothing.
std::array<std::string, 2> run_both(const std::filesystem::path& file, int good_of_follower) {
  Wire wire;
  std::array<std::string, 2> thrown;
  const auto part = [&](int rank, int good) {
    TwoThreads distribution(wire, rank);
    RunOptions options;
    options.distribution = &distribution;
    const RandomTiles source(good);
    try {
      run_tiles(source, small_run(), options, file, {});
    } catch (const Error& error) {
      thrown[static_cast<std::size_t>(rank)] = error.what();
    }
  };
  std::thread follower(part, 1, good_of_follower);
  part(0, kNever);
  follower.join();
  return thrown;
}

TEST(DistributedRun, TwoMakeTheBytesOfOne) {
  const TemporaryFolder folder;
  EXPECT_EQ(run_both(folder / "two.hlt", kNever), (std::array<std::string, 2>{}));
  run_tiles(RandomTiles(kNever), small_run(), {}, folder / "one.hlt", {});
  EXPECT_EQ(read_bytes(folder / "two.hlt"), read_bytes(folder / "one.hlt"));
}

// One gives up after three tiles: the run ends with its words and its number, says so on both
// sides, makes no file, and keeps all that was traced; going on gives the bytes of a run that
// nothing befell.
TEST(DistributedRun, OneThatFailsEndsTheRunAndKeepsTheJournal) {
  const TemporaryFolder folder;
  const auto thrown = run_both(folder / "a.hlt", 3);
  EXPECT_EQ(thrown[0], "process 1: the lamp went out");
  EXPECT_EQ(thrown[1], "process 1: the lamp went out");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.hlt"));
  const std::filesystem::path journal = folder / "a.hlt.partial";
  ASSERT_TRUE(std::filesystem::exists(journal));
  RunOptions again;
  again.resume = true;
  const PrecomputeReport report =
      run_tiles(RandomTiles(kNever), small_run(), again, folder / "a.hlt", {});
  EXPECT_GE(report.resumed_tiles, 3);
  EXPECT_LT(report.resumed_tiles, report.tiles);
  EXPECT_TRUE(report.complete);
  run_tiles(RandomTiles(kNever), small_run(), {}, folder / "one.hlt", {});
  EXPECT_EQ(read_bytes(folder / "a.hlt"), read_bytes(folder / "one.hlt"));
}

}  // namespace
}  // namespace haarlight
