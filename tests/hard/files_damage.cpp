// Rows 43 to 45: files that are cut short, damaged, crafted, or change while they are read.

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>
#include <xxhash.h>

#include <atomic>
#include <chrono>
#include <cstring>
#include <ctime>
#include <random>
#include <thread>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/transport_format.h"
#include "tests/fuzz/seeds.h"
#include "tests/fuzz/targets.h"
#include "tests/hard/hard_case.h"

#ifdef __SANITIZE_ADDRESS__
// OpenImageIO's readers leak where a file is damaged. That it was they is seen in the calls above
// an allocation, which the fast walk loses in libraries without frame pointers.
extern "C" const char* __asan_default_options() { return "fast_unwind_on_malloc=0"; }
#endif

namespace haarlight {
namespace {

using namespace hard;
using fuzz::Outcome;

fuzz::Bytes bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

/// Of the processor: what else a machine does is no fault of the reader. One that waits for ever
/// meets the limit of its test.
double seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}
double seconds_since(double begin) { return seconds() - begin; }

/// Most memory that this process ever had resident, MiB.
double peak_mib() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// Beyond the file's size. Sanitizers keep what is freed, and shadows of it.
double most_mib() { return std::getenv("HAARLIGHT_SANITIZED") ? 4096 : 64; }

bool same(const Transport& a, const Transport& b) {
  if (a.rows() != b.rows() || a.info().meta != b.info().meta ||
      a.info().camera != b.info().camera || a.width() != b.width() || a.height() != b.height() ||
      a.kind() != b.kind() || !std::ranges::equal(a.row_output(), b.row_output()) ||
      !std::ranges::equal(a.row_color(), b.row_color()) ||
      !std::ranges::equal(a.coverage(), b.coverage()) ||
      !std::ranges::equal(a.column_norms(), b.column_norms())) {
    return false;
  }
  if ((a.info().mesh != nullptr) != (b.info().mesh != nullptr)) return false;
  if (a.info().mesh && (a.info().mesh->position != b.info().mesh->position ||
                        a.info().mesh->triangle != b.info().mesh->triangle)) {
    return false;
  }
  if ((a.info().view != nullptr) != (b.info().view != nullptr)) return false;
  if (a.info().view && !(*a.info().view == *b.info().view)) return false;
  for (int c = 0; c < a.chunk_count(); ++c) {
    if (std::memcmp(a.rgb_blocks(c), b.rgb_blocks(c), 32) != 0) return false;
    for (int j = 0; j < a.layout().size(); ++j) {
      const ColumnBlocks x = a.column(c, j), y = b.column(c, j);
      if (x.bytes != y.bytes || (x.bytes > 0 && std::memcmp(x.present, y.present, x.bytes) != 0)) {
        return false;
      }
    }
  }
  return true;
}

/// Changes of every kind that damage has: bits, bytes, stretches, lost and doubled parts.
std::string mutated(std::string bytes, std::mt19937_64& random) {
  const auto place = [&] { return bytes.empty() ? 0 : random() % bytes.size(); };
  const int changes = random() % 2 == 0 ? 1 : 2 + static_cast<int>(random() % 15);
  for (int i = 0; i < changes && !bytes.empty(); ++i) {
    const std::size_t at = place();
    const std::size_t length = std::min<std::size_t>(1 + random() % 64, bytes.size() - at);
    switch (random() % 7) {
      case 0:
      case 1:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << (random() % 8)));
        break;
      case 2:
        bytes[at] = static_cast<char>(random());
        break;
      case 3:
        bytes.replace(at, length, length, random() % 2 ? '\0' : '\xff');
        break;
      case 4:
        bytes.erase(at, length);
        break;
      case 5:
        bytes.insert(at, bytes.substr(place(), length));
        break;
      default:
        bytes.replace(at, length, bytes.substr(place(), length));
        break;
    }
  }
  return bytes;
}

/// What became of many damaged inputs.
struct Damage {
  int refused = 0, unharmed = 0, silent = 0;
  double slowest = 0;  ///< seconds
};

void open_damaged(const std::string& bytes, const Transport& right, Damage& damage) {
  const double begin = seconds();
  bool equal = false;
  const Outcome outcome = fuzz::with_file(
      "damaged.hlt", bytes_of(bytes),
      [&](const std::filesystem::path& file) { equal = same(Transport::open(file), right); });
  damage.slowest = std::max(damage.slowest, seconds_since(begin));
  if (outcome == Outcome::refused) {
    ++damage.refused;
  } else {
    ++(equal ? damage.unharmed : damage.silent);
  }
}

Transport opened(const std::string& bytes) {
  std::optional<Transport> transport;
  fuzz::with_file("right.hlt", bytes_of(bytes),
                  [&](const std::filesystem::path& file) { transport = Transport::open(file); });
  return transport.value();
}

int mutations(int in_suite, int in_full) { return full() ? in_full : in_suite; }

class OneThread : public testing::Test {
 protected:
  OneThread() { set_thread_count(1); }  // files of a chunk: a second thread only waits
  ~OneThread() override { set_thread_count(before_); }
  int before_ = thread_count();
};
class HardCases : public OneThread {};

TEST_F(HardCases, Row43_TransportsCutShort) {
  property("every truncated transport is a typed error");
  double memory = 0, file_mib = 0;
  Damage damage;
  for (const std::string& bytes : fuzz::transport_seeds()) {
    const Transport right = opened(bytes);
    const double before = peak_mib();
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      open_damaged(bytes.substr(0, length), right, damage);
    }
    memory = std::max(memory, peak_mib() - before);
    file_mib = std::max(file_mib, static_cast<double>(bytes.size()) / 1048576);
  }
  at_most("lengths taken for a whole file", damage.unharmed + damage.silent, 0);
  at_least("lengths tried", damage.refused, 10000);
  // Checked sizes before memory is asked for.
  at_most("memory, MiB", memory, file_mib + most_mib());
  at_most("slowest, s of processor", damage.slowest, 1);
}

TEST_F(HardCases, Row43_TransportsDamaged) {
  property("a transport with any bytes changed is a typed error or the same transport");
  Damage damage;
  double memory = 0;
  const std::vector<std::string> seeds = fuzz::transport_seeds();
  std::mt19937_64 random(43);
  for (const std::string& bytes : seeds) {
    const Transport right = opened(bytes);
    const double before = peak_mib();
    const int rounds = mutations(100'000, 1'000'000) / static_cast<int>(seeds.size());
    for (int i = 0; i < rounds; ++i) open_damaged(mutated(bytes, random), right, damage);
    memory = std::max(memory, peak_mib() - before);
  }
  at_most("read as something else", damage.silent, 0);
  at_least("refused", damage.refused, 50'000);
  at_least("unharmed (between sections)", damage.unharmed, 1);
  at_most("memory, MiB", memory, most_mib());
  at_most("slowest, s of processor", damage.slowest, 1);
}

TEST_F(HardCases, Row43_TransportsCrafted) {
  property("with right checksums over wrong bytes a transport is refused or can be used");
  std::mt19937_64 random(44);
  double slowest = 0;
  int refused = 0, accepted = 0;
  const std::vector<std::string> seeds = fuzz::transport_seeds();
  const double before = peak_mib();
  for (int i = 0; i < mutations(10'000, 200'000); ++i) {
    const std::string bytes = mutated(seeds[static_cast<std::size_t>(i) % seeds.size()], random);
    const double begin = seconds();
    ++(fuzz::transport_as_it_is(fuzz::with_right_checksums(bytes_of(bytes))) == Outcome::refused
           ? refused
           : accepted);
    slowest = std::max(slowest, seconds_since(begin));
  }
  at_least("refused", refused, 100);
  at_least("used", accepted, 100);
  at_most("memory, MiB", peak_mib() - before, most_mib());
  at_most("slowest, s of processor", slowest, 1);
}

TEST_F(HardCases, Row43_OtherFilesDamaged) {
  property("journals, recordings and environments: damaged ones are typed errors or usable");
  std::mt19937_64 random(45);
  const double before = peak_mib();
  double slowest = 0;
  int refused = 0, tried = 0;
  const auto damage_all = [&](const std::vector<std::string>& seeds, int rounds,
                              Outcome (*target)(fuzz::Bytes)) {
    for (const std::string& seed : seeds) {
      // Every length of what is short, then mutations.
      for (std::size_t length = 0; length < seed.size(); length += 1 + seed.size() / 500) {
        refused += target(bytes_of(seed.substr(0, length))) == Outcome::refused;
        ++tried;
      }
    }
    for (int i = 0; i < rounds; ++i) {
      const std::string bytes = mutated(seeds[static_cast<std::size_t>(i) % seeds.size()], random);
      const double begin = seconds();
      refused += target(bytes_of(bytes)) == Outcome::refused;
      ++tried;
      slowest = std::max(slowest, seconds_since(begin));
    }
  };
  damage_all(fuzz::transport_seeds(true), mutations(2'000, 50'000), fuzz::journal);
  damage_all(fuzz::recording_seeds(), mutations(10'000, 100'000), fuzz::recording);
  damage_all(fuzz::environment_seeds(), mutations(5'000, 50'000), fuzz::environment);
  at_least("refused", refused, tried / 4);
  at_most("memory, MiB", peak_mib() - before, most_mib());
  at_most("slowest, s of processor", slowest, 1);
}

TEST_F(HardCases, Row43_TextThatNestsDeep) {
  property("text nested a million deep is a typed error, not a full stack");
  const std::string deep = std::string(1'000'000, '[') + std::string(1'000'000, ']');
  const std::string recording =
      R"({"format":"haarlight-motion","version":1,"environments":["a.exr"],"frames":[{"from":)" +
      deep + "}]}";
  int refused = fuzz::recording(bytes_of(recording)) == Outcome::refused;
  // A description of a transport, with right checksums.
  std::string bytes = fuzz::transport_seeds().front();
  TransportHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  header.meta = {bytes.size(), deep.size(), 0};
  std::memcpy(bytes.data(), &header, sizeof header);
  bytes += deep;
  refused +=
      fuzz::transport_as_it_is(fuzz::with_right_checksums(bytes_of(bytes))) == Outcome::refused;
  at_least("refused of 2", refused, 2);
}

TEST_F(HardCases, Row44_HeadersThatPromiseTooMuch) {
  property("sizes beyond the file, or wrapping round, are refused before memory is asked for");
  const TemporaryFolder folder;
  const std::string bytes = fuzz::transport_seeds().back();  // a mesh with view factors
  TransportHeader right;
  std::memcpy(&right, bytes.data(), sizeof right);
  constexpr std::uint64_t kSparse = std::uint64_t{1} << 40;
  const double before = peak_mib();
  double slowest = 0;
  int tried = 0, opened_all_the_same = 0;
  const auto attempt = [&](TransportHeader header, std::uint64_t file_size) {
    header.file_size = file_size;
    header.header_hash = XXH3_64bits(&header, offsetof(TransportHeader, header_hash));
    std::string crafted = bytes;
    std::memcpy(crafted.data(), &header, sizeof header);
    const std::filesystem::path file = folder / "crafted.hlt";
    write_bytes(file, crafted);
    // A sparse file is as large as it likes at no cost to whoever made it.
    ASSERT_EQ(::truncate(file.c_str(), static_cast<off_t>(file_size)), 0);
    const double begin = seconds();
    try {
      Transport::open(file);
      ++opened_all_the_same;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("crafted.hlt"), std::string::npos) << error.what();
    }
    slowest = std::max(slowest, seconds_since(begin));
    ++tried;
  };
  for (const std::uint64_t file_size : {std::uint64_t{bytes.size()}, kSparse}) {
    for (std::uint32_t TransportHeader::*field :
         {&TransportHeader::width, &TransportHeader::height, &TransportHeader::chunk_count,
          &TransportHeader::face_size, &TransportHeader::vertices, &TransportHeader::triangles,
          &TransportHeader::terms}) {
      for (const std::uint32_t value :
           {0u, 1024u, 65535u, 65537u, 0x10000u, 1u << 19, 0x7fffffffu, 0x80000000u, 0xffffffffu}) {
        TransportHeader header = right;
        if (header.*field == value) continue;
        // The picture's size says nothing about a mesh's rows.
        const bool harmless =
            (field == &TransportHeader::width || field == &TransportHeader::height) && value > 0 &&
            value <= 65536;
        if (harmless && file_size != kSparse) continue;
        header.*field = value;
        ASSERT_NO_FATAL_FAILURE(attempt(header, file_size)) << value;
        if (harmless) opened_all_the_same = 0;
      }
    }
    // 65537 x 65537 and 65536 x 65536 wrap round in 32 bits, to 131073 and 0.
    TransportHeader picture = right;
    picture.kind = 0;
    picture.terms = 1;
    picture.vertices = picture.triangles = picture.mesh_materials = 0;
    picture.mesh = {};
    for (const std::uint32_t side : {65536u, 65537u, 0x10000001u}) {
      picture.width = picture.height = side;
      for (const std::uint32_t chunks : {1u, 33u, 1u << 19, 1u << 20, 0xffffffffu}) {
        picture.chunk_count = chunks;
        ASSERT_NO_FATAL_FAILURE(attempt(picture, file_size)) << side;
      }
    }
    for (FileSection TransportHeader::*field :
         {&TransportHeader::meta, &TransportHeader::rows, &TransportHeader::column_norms,
          &TransportHeader::chunk_table, &TransportHeader::mesh, &TransportHeader::named}) {
      for (const std::uint64_t value : {std::uint64_t{1} << 32, std::uint64_t{1} << 39,
                                        std::uint64_t{1} << 63, ~std::uint64_t{0}}) {
        TransportHeader header = right;
        (header.*field).size = value;
        ASSERT_NO_FATAL_FAILURE(attempt(header, file_size)) << value;
        header = right;
        (header.*field).offset = value;
        ASSERT_NO_FATAL_FAILURE(attempt(header, file_size)) << value;
      }
    }
  }
  at_least("headers tried", tried, 200);
  at_most("opened", opened_all_the_same, 0);
  at_most("memory, MiB", peak_mib() - before, most_mib());
  at_most("slowest, s of processor", slowest, 1);
}

TEST_F(HardCases, Row45_FilesThatShrinkWhileInUse) {
  property(
      "a transport whose file is cut or overwritten stays what it was; cut while it is opened, "
      "it is an error or whole");
  const TemporaryFolder folder;
  const fixtures::SmallTransport small = fixtures::small_transport(8, 64, 64, 9);
  const std::string bytes = fuzz::transport_seed(small);
  const std::filesystem::path file = folder / "a.hlt";
  const Transport right = opened(bytes);

  write_bytes(file, bytes);
  const Transport in_use = Transport::open(file);
  ASSERT_EQ(::truncate(file.c_str(), 100), 0);  // a mapping would end in SIGBUS here
  int changed = !same(in_use, right);
  write_bytes(file, std::string(bytes.size(), 'x'));
  changed += !same(in_use, right);
  at_most("transports in use that changed", changed, 0);

  std::atomic<bool> stop{false};
  std::thread cutter([&] {
    std::mt19937_64 random(7);
    while (!stop) {
      const int descriptor = ::open(file.c_str(), O_WRONLY);
      static_cast<void>(::pwrite(descriptor, bytes.data(), bytes.size(), 0));
      std::this_thread::sleep_for(std::chrono::microseconds(random() % 300));
      static_cast<void>(::ftruncate(descriptor, static_cast<off_t>(random() % bytes.size())));
      ::close(descriptor);
    }
  });
  int whole = 0, refused = 0, wrong = 0;
  // On a busy machine the cutter may be long in coming.
  for (int i = 0; i < 3000 || (refused < 10 && i < 1'000'000); ++i) {
    try {
      ++(same(Transport::open(file), right) ? whole : wrong);
    } catch (const Error&) {
      ++refused;
    }
  }
  stop = true;
  cutter.join();
  at_most("opened as something else", wrong, 0);
  at_least("refused", refused, 10);
}

}  // namespace
}  // namespace haarlight
