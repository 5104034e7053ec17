// The log that fault_shim.cpp keeps: operations in their order, each an entry and its two parts.

#pragma once

#include <cstdint>

namespace haarlight::hard {

enum class LogOp : std::uint64_t {
  create,       ///< inode; first: path
  write,        ///< inode, offset; first: path; second: bytes
  truncate,     ///< inode, offset: the new size
  sync,         ///< inode; first: path
  sync_folder,  ///< first: path
  rename,       ///< first: from, second: to
  remove,       ///< first: path
};

struct LogEntry {
  LogOp op;
  std::uint64_t inode, offset;
  std::uint64_t first, second;  ///< bytes of the two parts that follow
};

}  // namespace haarlight::hard
