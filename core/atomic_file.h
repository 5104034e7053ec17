// Files that appear whole or not at all.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace haarlight {

/// A file being written under a temporary name beside its final one. commit() makes it appear:
/// flush, fsync, rename, fsync of the folder. Without commit() the destructor removes the
/// temporary, and what was there under the final name stays untouched. A link is followed; a
/// device or a folder under the final name is refused.
/// Every call throws Error{io} naming the final file and the system's reason.
class AtomicFile {
 public:
  explicit AtomicFile(const std::filesystem::path& final_path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  void write(const void* bytes, std::size_t size);  ///< at the end
  void write_at(std::uint64_t offset, const void* bytes, std::size_t size);
  std::uint64_t size() const { return size_; }  ///< the end of what was written, in bytes
  void commit();

 private:
  std::filesystem::path final_path_, target_path_, temporary_path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace haarlight
