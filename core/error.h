// The one exception type of the library.

#pragma once

#include <stdexcept>
#include <string>

namespace haarlight {

/// What went wrong, for programs that want to react rather than print.
enum class ErrorKind {
  invalid_argument,  ///< an option or argument outside its stated range
  io,                ///< the operating system refused: cannot read, write, create, sync
  format,            ///< the file is not what it claims to be, is cut short or damaged
  missing,           ///< something that must be there is not: a file, triangles, a camera
  cancelled,         ///< the caller's progress callback asked to stop
};

/// Every failure the library reports. what() is one line without a final period or newline that
/// says what, where and what was wanted: "a.exr: 12 of 131072 pixels are not finite, expected
/// none". The library never prints and never exits.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, const std::string& message) : std::runtime_error(message), kind_(kind) {}
  ErrorKind kind() const noexcept { return kind_; }

 private:
  ErrorKind kind_;
};

}  // namespace haarlight
