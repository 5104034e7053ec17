// Other processes that take part in a run.

#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace haarlight {

/// One of several processes that make one transport together, each with the whole scene. The leader
/// (rank 0) owns journal and file and hands out tiles; it traces too. All of it works between
/// processes of one kind of machine: records travel as they lie in memory.
class Distribution {
 public:
  virtual ~Distribution() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  bool leads() const { return rank() == 0; }

  /// Called by all, each with what went wrong at its place, or nothing: returns the message of the
  /// lowest rank that has one, or nothing, everywhere the same.
  virtual std::string agree(const std::string& failure) = 0;
  /// Called by all: the leader's bytes, everywhere.
  virtual std::vector<std::byte> broadcast(const std::vector<std::byte>& bytes) = 0;

  /// Leader: answers requests until every other process has left. `next` gives
  /// a tile or nothing, `take` gets packed records, `failed` the message of a process that failed;
  /// `idle` is called about every millisecond.
  virtual void serve(const std::function<std::optional<int>()>& next,
                     const std::function<void(std::vector<std::byte>)>& take,
                     const std::function<void(const std::string&)>& failed,
                     const std::function<void()>& idle) = 0;

  /// Others: hands in a finished record (empty: none) and asks for a tile. Thread-safe.
  virtual std::optional<int> exchange(const std::vector<std::byte>& record) = 0;
  /// Others: the last word of a process, after its last exchange(): nothing, or what went wrong.
  virtual void leave(const std::string& failure) = 0;
};

/// Runs `work` here and everywhere; if it threw anywhere, throws everywhere: the own error where
/// there is one, else Error{io} with the message of the lowest rank that failed. Without a
/// distribution, just runs it.
void together(Distribution* distribution, const std::function<void()>& work);

}  // namespace haarlight
