// What is done with bytes from outside, as one call a kind of input: for fuzzers (tests/fuzz/) and
// for the mutations of the suite (tests/hard/files_*.cpp).

#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace haarlight::fuzz {

using Bytes = std::span<const std::byte>;

/// What became of an input. Whatever else can be - a signal, another exception, an error without
/// the file's name - ends the program, as a fuzzer wants it.
enum class Outcome { accepted, refused };

/// A transport: opened, every column read, a frame relit and drawn. First as it is, then with all
/// its checksums made right, as a crafted one has them: else nothing behind them is ever reached.
Outcome transport(Bytes bytes);
/// The first half of it, with checksums as they are.
Outcome transport_as_it_is(Bytes bytes);
/// Makes the checksums of a transport right as far as it is one.
std::vector<std::byte> with_right_checksums(Bytes bytes);

/// A journal: opened, every record read, made a transport of, which is then used. As it is, and
/// with its checksums made right.
Outcome journal(Bytes bytes);
Outcome journal_as_it_is(Bytes bytes);
std::vector<std::byte> journal_with_right_checksums(Bytes bytes);
/// A recorded motion; what is taken in is written out and taken in again.
Outcome recording(Bytes bytes);
/// An environment: loaded, sampled onto a cube map. The first byte chooses EXR, HDR or PNG.
Outcome environment(Bytes bytes);
/// A scene: imported with its clean-up and materials. The first byte chooses GLB, glTF, OBJ or PLY.
Outcome scene(Bytes bytes);
/// A scene that moves, as GLB: read, and taken at its first frame, its last and one far beyond.
Outcome animation(Bytes bytes);
/// Calls of the library with numbers of any kind: trackers, sums, relighters, cameras,
/// environments. The bytes say which and with what.
Outcome api(Bytes bytes);

/// Writes `bytes` as NAME in a folder of this process's own, in memory where there is such, and
/// calls `use` with it. An Error of one line that names the file is a refusal.
Outcome with_file(const std::string& name, Bytes bytes,
                  const std::function<void(const std::filesystem::path&)>& use);

/// Ends the program, saying why.
[[noreturn]] void fault(const std::string& what);

}  // namespace haarlight::fuzz
