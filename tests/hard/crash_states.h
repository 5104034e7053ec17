// What a disk may hold after the power failed, from the log of what a program did (row 48).
//
// The model takes back what systems do not promise. Of a file, all that was written or cut since
// its last fsync may be there or not, each operation by itself, a write also up to any sector of
// 512 bytes. Of a folder, each name that was made, renamed or removed since its last fsync may be
// so or not.

#pragma once

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/core/temporary_folder.h"
#include "tests/hard/write_log.h"

namespace haarlight::hard {

struct LoggedOp {
  LogEntry entry{};
  std::string first, second;
};

inline std::vector<LoggedOp> read_log(const std::filesystem::path& file) {
  const std::string bytes = read_bytes(file);
  std::vector<LoggedOp> ops;
  for (std::size_t at = 0; at + sizeof(LogEntry) <= bytes.size();) {
    LoggedOp op;
    std::memcpy(&op.entry, bytes.data() + at, sizeof op.entry);
    at += sizeof op.entry;
    op.first = bytes.substr(at, op.entry.first);
    op.second = bytes.substr(at + op.entry.first, op.entry.second);
    at += op.entry.first + op.entry.second;
    ops.push_back(std::move(op));
  }
  return ops;
}

class CrashStates {
 public:
  /// `before`: what was on the disk, by path.
  CrashStates(std::vector<LoggedOp> ops, const std::map<std::string, std::string>& before)
      : ops_(std::move(ops)) {
    std::uint64_t made_up = ~std::uint64_t{0};
    for (const auto& [path, bytes] : before) {
      durable_[made_up] = bytes;
      names_[path] = made_up--;
    }
  }

  std::size_t operations() const { return ops_.size(); }

  /// The files of one state after the first `count` operations.
  std::map<std::string, std::string> state(std::size_t count, std::mt19937_64& random) const {
    std::map<std::uint64_t, std::string> durable = durable_;
    std::map<std::uint64_t, std::vector<const LoggedOp*>> pending;
    std::map<std::string, std::uint64_t> names = names_, latest = names_;
    struct NameChange {
      std::string path;
      std::uint64_t inode;  // 0: removed
    };
    std::vector<NameChange> name_changes;
    for (std::size_t i = 0; i < count; ++i) {
      const LoggedOp& op = ops_[i];
      const std::uint64_t inode = op.entry.inode;
      switch (op.entry.op) {
        case LogOp::create:
          durable[inode].clear();
          pending[inode].clear();
          name_changes.push_back({op.first, inode});
          latest[op.first] = inode;
          break;
        case LogOp::write:
        case LogOp::truncate:
          pending[inode].push_back(&op);
          break;
        case LogOp::sync:
          for (const LoggedOp* change : pending[inode])
            apply(*change, ~std::size_t{0}, durable[inode]);
          pending[inode].clear();
          break;
        case LogOp::sync_folder:
          for (const NameChange& change : name_changes) set(change.path, change.inode, names);
          name_changes.clear();
          break;
        case LogOp::rename: {
          const std::uint64_t moved = latest[op.first];
          name_changes.push_back({op.second, moved});
          name_changes.push_back({op.first, 0});
          set(op.second, moved, latest);
          set(op.first, 0, latest);
          break;
        }
        case LogOp::remove:
          name_changes.push_back({op.first, 0});
          set(op.first, 0, latest);
          break;
      }
    }
    // Some states lose all, or nothing: these are likely, and chance alone would miss them.
    const auto mood = random() % 4;
    const auto kept = [&] { return mood == 0 ? false : mood == 1 ? true : random() % 2 == 0; };
    for (const NameChange& change : name_changes) {
      if (kept()) set(change.path, change.inode, names);
    }
    for (const auto& [inode, changes] : pending) {
      for (const LoggedOp* change : changes) {
        if (!kept()) continue;
        const std::size_t sectors = change->second.size() / 512 + 1;
        const bool torn = mood > 1 && random() % 3 == 0;
        apply(*change, torn ? 512 * (random() % sectors) : ~std::size_t{0}, durable[inode]);
      }
    }
    std::map<std::string, std::string> files;
    for (const auto& [path, inode] : names) files[path] = durable[inode];
    return files;
  }

 private:
  static void set(const std::string& path, std::uint64_t inode,
                  std::map<std::string, std::uint64_t>& names) {
    if (inode == 0) {
      names.erase(path);
    } else {
      names[path] = inode;
    }
  }

  static void apply(const LoggedOp& op, std::size_t most, std::string& bytes) {
    if (op.entry.op == LogOp::truncate) {
      bytes.resize(op.entry.offset);
      return;
    }
    const std::size_t size = std::min(most, op.second.size());
    if (size == 0) return;
    if (bytes.size() < op.entry.offset + size) bytes.resize(op.entry.offset + size);
    bytes.replace(op.entry.offset, size, op.second, 0, size);
  }

  std::vector<LoggedOp> ops_;
  std::map<std::uint64_t, std::string> durable_;
  std::map<std::string, std::uint64_t> names_;
};

}  // namespace haarlight::hard
