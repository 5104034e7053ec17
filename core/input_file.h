// A file that is read by place, never mapped: what another process does to it meanwhile is an error
// with a message, and no signal.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace haarlight {

class InputFile {
 public:
  /// Throws Error{missing} if there is no such file, Error{io} if it is no plain file or the system
  /// refuses.
  explicit InputFile(const std::filesystem::path& file);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  std::uint64_t size() const { return size_; }  ///< bytes, when it was opened

  /// Fills `bytes` from `offset` on. Thread-safe. Throws Error{format} if the file ends before,
  /// Error{io} if the system refuses.
  void read(std::uint64_t offset, std::span<std::byte> bytes) const;

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace haarlight
