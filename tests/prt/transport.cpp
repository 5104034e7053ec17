// Coding, files and resuming: T as stored is what was written, or an error is thrown.

#include "prt/transport.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <numeric>
#include <random>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/chunk.h"
#include "prt/transport_writer.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

using fixtures::SmallTransport;
using fixtures::TemporaryFolder;

std::vector<char> bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_bytes(const std::filesystem::path& file, const std::vector<char>& bytes) {
  std::ofstream(file, std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

void write_file(const SmallTransport& small, const std::filesystem::path& file,
                const std::vector<int>& order) {
  TransportWriter writer(file, small.info, {small.thresholds, "test", false});
  for (int tile : order) writer.write_tile(tile, small.tiles[static_cast<std::size_t>(tile)]);
  writer.finish(R"({"made_by": "test"})");
}

std::vector<int> all_tiles(const SmallTransport& small) {
  std::vector<int> order(
      static_cast<std::size_t>(((small.info.width + 7) / 8) * ((small.info.height + 7) / 8)));
  std::iota(order.begin(), order.end(), 0);
  return order;
}

// Every stored block of two transports.
void expect_same_columns(const Transport& a, const Transport& b) {
  ASSERT_EQ(a.chunk_count(), b.chunk_count());
  for (int c = 0; c < a.chunk_count(); ++c) {
    for (int w = 0; w < 4; ++w) ASSERT_EQ(a.rgb_blocks(c)[w], b.rgb_blocks(c)[w]);
    for (int j = 0; j < a.layout().size(); ++j) {
      const ColumnBlocks x = a.column(c, j), y = b.column(c, j);
      ASSERT_EQ(x.present == nullptr, y.present == nullptr);
      if (!x.present) continue;
      int scales = 0;
      for (int w = 0; w < 4; ++w) {
        ASSERT_EQ(x.present[w], y.present[w]);
        scales +=
            std::popcount(x.present[w]) + 2 * std::popcount(x.present[w] & a.rgb_blocks(c)[w]);
      }
      ASSERT_TRUE(std::equal(x.scales, x.scales + scales, y.scales));
      ASSERT_TRUE(std::equal(x.values, x.values + 16 * scales, y.values));
    }
  }
}

TEST(TileCodec, ErrorIsAtMostHalfAStep) {
  const HaarLayout layout(8);
  std::mt19937_64 random(1);
  for (int round = 0; round < 20; ++round) {
    const TileRows rows = fixtures::random_tile(layout, random, 0.7, round % 2);
    const CompressedTile tile = compress_tile(layout, rows, std::vector<float>(3, 0.0f));
    std::vector<float> back;
    decompress_tile(layout, tile, back);
    ASSERT_EQ(back.size(), rows.values.size());
    const auto size = static_cast<std::size_t>(layout.size());
    for (std::size_t first = 0; first < back.size(); first += kBlockRows * size) {
      for (std::size_t j = 0; j < size; ++j) {
        float peak = 0;
        for (std::size_t r = 0; r < kBlockRows; ++r) {
          peak = std::max(peak, std::abs(rows.values[first + r * size + j]));
        }
        // Step = peak / 127, rounded up to 8 significant bits; half of it, and float rounding.
        const float bound = 0.5f * peak / 127 * (1 + 0x1p-7f) * (1 + 0x1p-20f);
        for (std::size_t r = 0; r < kBlockRows; ++r) {
          ASSERT_LE(std::abs(back[first + r * size + j] - rows.values[first + r * size + j]),
                    bound);
        }
      }
    }
  }
}

TEST(TileCodec, DropsExactlyTheBlocksBelowTheThreshold) {
  const HaarLayout layout(2);
  TileRows rows;
  rows.values.assign(static_cast<std::size_t>(kTileRows * 24), 0.0f);
  rows.color.assign(kTileRows, Rgb{1, 1, 1});
  rows.coverage.assign(kTileRows, 1.0f);
  for (int r = 0; r < 16; ++r) rows.values[static_cast<std::size_t>(r * 24 + 5)] = 0.01f;
  rows.values[16 * 24 + 7] = 0.039f;  // alone in its block: RMS 0.00975
  const CompressedTile tile = compress_tile(layout, rows, std::vector<float>{0.0099f});
  EXPECT_EQ(tile.scales.size(), 1u);
  EXPECT_EQ(tile.present[2], 0x10);  // column 5 is the upper half of byte 2, block 0
  EXPECT_EQ(tile.present[3], 0);
  EXPECT_EQ(compress_tile(layout, rows, std::vector<float>{0.0097f}).scales.size(), 2u);
}

TEST(TileCodec, ScalesRoundUpToTheNextStoredFloat) {
  for (float scale : {0.0f, 1.0f, 1.001f, 3e-7f, 0.3f}) {
    const float stored = scale_from_bits(scale_to_bits(scale));
    EXPECT_GE(stored, scale);
    EXPECT_LE(stored, scale * (1 + 0x1p-7f));
  }
}

TEST(TileCodec, RefusesWhatIsNotFinite) {
  const HaarLayout layout(2);
  std::mt19937_64 random(2);
  TileRows rows = fixtures::random_tile(layout, random, 1, false);
  rows.values[100] = NAN;
  EXPECT_THROW(compress_tile(layout, rows, std::vector<float>{0.0f}), Error);
  rows.values.pop_back();
  EXPECT_THROW(compress_tile(layout, rows, std::vector<float>{0.0f}), Error);
}

TEST(ImageRowOrder, HasEveryPixelOnceInTilesOfEight) {
  for (const auto& [width, height] : {std::pair{1, 1}, {8, 8}, {64, 64}, {100, 37}, {512, 512}}) {
    const auto order = image_row_order(width, height);
    EXPECT_EQ(order.size() % kChunkRows, 0u);
    std::vector<int> seen(static_cast<std::size_t>(width * height), 0);
    for (std::size_t row = 0; row < order.size(); ++row) {
      if (order[row] == kNoOutput) continue;
      ++seen[order[row]];
      const std::size_t tile_first = row / kTileRows * kTileRows;
      const auto w = static_cast<std::uint32_t>(width);
      // All rows of a tile lie in one aligned square of 8x8 pixels; the first row is its corner.
      EXPECT_EQ(order[row] % w / 8, order[tile_first] % w / 8);
      EXPECT_EQ(order[row] / w / 8, order[tile_first] / w / 8);
    }
    EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](int n) { return n == 1; }));
  }
}

TEST(TransportFile, ReadsBackWhatWasWrittenWhateverTheOrder) {
  const TemporaryFolder folder;
  for (const auto& [width, height] : {std::pair{100, 37}, {5, 3}, {128, 64}}) {
    const SmallTransport small = fixtures::small_transport(8, width, height, 5);
    auto order = all_tiles(small);
    write_file(small, folder / "a.hlt", order);
    std::shuffle(order.begin(), order.end(), std::mt19937(3));
    set_thread_count(7);
    write_file(small, folder / "b.hlt", order);
    set_thread_count(1);
    write_file(small, folder / "c.hlt", order);
    set_thread_count(2);
    EXPECT_EQ(bytes_of(folder / "a.hlt"), bytes_of(folder / "b.hlt"));
    EXPECT_EQ(bytes_of(folder / "a.hlt"), bytes_of(folder / "c.hlt"));
    EXPECT_FALSE(std::filesystem::exists(folder / "a.hlt.partial"));

    const Transport file = Transport::open(folder / "a.hlt");
    const Transport memory = build_transport(small.info, small.tiles, small.thresholds);
    expect_same_columns(file, memory);
    EXPECT_EQ(file.width(), width);
    EXPECT_EQ(file.height(), height);
    EXPECT_NE(file.info().meta.find("measured_error"), std::string::npos);
    EXPECT_TRUE(std::ranges::equal(file.row_output(), memory.row_output()));
    EXPECT_TRUE(std::ranges::equal(file.row_color(), memory.row_color()));
    EXPECT_TRUE(std::ranges::equal(file.coverage(), memory.coverage()));
    EXPECT_TRUE(std::ranges::equal(file.column_norms(), memory.column_norms()));
    EXPECT_EQ(file.file_bytes(), std::filesystem::file_size(folder / "a.hlt"));
    std::uint64_t columns = 0;
    for (int j = 0; j < file.layout().size(); ++j) columns += file.column_bytes(j);
    EXPECT_LE(columns, file.chunk_bytes());
  }
}

TEST(TransportFile, ColumnNormsAreThoseOfTheDenseMatrix) {
  const SmallTransport small = fixtures::small_transport(4, 16, 16, 8);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const auto t = fixtures::dense(small);
  for (std::size_t j = 0; j < 96; ++j) {
    double sum = 0;
    for (std::size_t i = j; i < t.size(); i += 96) sum += t[i] * t[i];
    EXPECT_NEAR(transport.column_norms()[j], std::sqrt(sum), 1e-6 * std::sqrt(sum));
  }
}

TEST(TransportFile, MeasuredErrorIsThatOfTheDroppedEntries) {
  // With threshold 0 only rounding is left: entries to within 1/254 of their block's peak.
  const TemporaryFolder folder;
  for (const float threshold : {0.0f, 0.02f}) {
    const SmallTransport small = fixtures::small_transport(8, 64, 64, 6, 0.5, true, threshold);
    write_file(small, folder / "a.hlt", all_tiles(small));
    const std::string meta = Transport::open(folder / "a.hlt").info().meta;
    const double error = std::stod(meta.substr(meta.find("measured_error") + 17));
    if (threshold == 0) {
      EXPECT_GT(error, 0.0);
      EXPECT_LT(error, 1.0 / 127);
    } else {
      EXPECT_GT(error, 0.02);
    }
  }
}

TEST(TransportFile, ResumesToTheSameBytes) {
  const TemporaryFolder folder;
  const SmallTransport small = fixtures::small_transport(8, 64, 40, 7);
  const auto order = all_tiles(small);
  write_file(small, folder / "whole.hlt", order);
  {
    TransportWriter writer(folder / "cut.hlt", small.info, {small.thresholds, "test", false});
    for (int tile : {3, 9, 17})
      writer.write_tile(tile, small.tiles[static_cast<std::size_t>(tile)]);
  }
  ASSERT_FALSE(std::filesystem::exists(folder / "cut.hlt"));
  // The cut tore the last record.
  std::filesystem::resize_file(folder / "cut.hlt.partial",
                               std::filesystem::file_size(folder / "cut.hlt.partial") - 5);
  {
    TransportWriter writer(folder / "cut.hlt", small.info, {small.thresholds, "test", true});
    EXPECT_TRUE(writer.has_tile(3));
    EXPECT_TRUE(writer.has_tile(9));
    EXPECT_FALSE(writer.has_tile(17));
    for (int tile : order) {
      if (!writer.has_tile(tile))
        writer.write_tile(tile, small.tiles[static_cast<std::size_t>(tile)]);
    }
    writer.finish(R"({"made_by": "test"})");
  }
  EXPECT_EQ(bytes_of(folder / "cut.hlt"), bytes_of(folder / "whole.hlt"));
}

TEST(TransportFile, DoesNotResumeAnotherScenesJournal) {
  const TemporaryFolder folder;
  const SmallTransport small = fixtures::small_transport(8, 16, 16, 7);
  {
    TransportWriter writer(folder / "a.hlt", small.info, {small.thresholds, "one scene", false});
    writer.write_tile(0, small.tiles[0]);
  }
  TransportWriter same(folder / "a.hlt", small.info, {small.thresholds, "one scene", true});
  EXPECT_TRUE(same.has_tile(0));
  TransportWriter other(folder / "a.hlt", small.info, {small.thresholds, "another", true});
  EXPECT_FALSE(other.has_tile(0));
}

TEST(TransportFile, EveryTruncationIsATypedError) {
  const TemporaryFolder folder;
  const SmallTransport small = fixtures::small_transport(2, 8, 8, 9, 0.4, false);
  write_file(small, folder / "a.hlt", all_tiles(small));
  const auto bytes = bytes_of(folder / "a.hlt");
  for (std::size_t length = 0; length < bytes.size(); length += length < 600 ? 1 : 97) {
    write_bytes(folder / "cut.hlt", {bytes.begin(), bytes.begin() + static_cast<long>(length)});
    try {
      Transport::open(folder / "cut.hlt");
      FAIL() << "opened at " << length << " of " << bytes.size() << " bytes";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::format) << error.what();
      EXPECT_NE(std::string(error.what()).find("cut.hlt"), std::string::npos);
    }
  }
}

TEST(TransportFile, EveryFlippedByteIsAnErrorOrTheSameTransport) {
  const TemporaryFolder folder;
  const SmallTransport small = fixtures::small_transport(2, 8, 8, 9, 0.4, false);
  write_file(small, folder / "a.hlt", all_tiles(small));
  const auto bytes = bytes_of(folder / "a.hlt");
  const Transport right = Transport::open(folder / "a.hlt");
  int refused = 0, same = 0;
  // All of the header, and a stride elsewhere that is prime to every alignment.
  for (std::size_t at = 0; at < bytes.size(); at += at < 400 ? 1 : 13) {
    auto bad = bytes;
    bad[at] = static_cast<char>(bad[at] ^ (1 << (at % 8)));
    write_bytes(folder / "bad.hlt", bad);
    try {
      const Transport opened = Transport::open(folder / "bad.hlt");
      ++same;
      ASSERT_NO_FATAL_FAILURE(expect_same_columns(opened, right)) << "byte " << at;
      ASSERT_EQ(opened.info().meta, right.info().meta);
      ASSERT_TRUE(std::ranges::equal(opened.row_color(), right.row_color()));
    } catch (const Error& error) {
      ++refused;
      ASSERT_EQ(error.kind(), ErrorKind::format) << error.what();
    }
  }
  // Only padding between sections may pass.
  EXPECT_GT(refused, 0);
  EXPECT_LT(static_cast<std::size_t>(same), (2 * 4096u + 128u) / 13) << refused << " refused";
}

TEST(TransportFile, NamesWhatIsWrong) {
  const TemporaryFolder folder;
  const auto message = [&](const std::filesystem::path& file, ErrorKind kind) -> std::string {
    try {
      Transport::open(file);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), kind);
      return error.what();
    }
    ADD_FAILURE() << "opened " << file;
    return {};
  };
  message(folder / "absent.hlt", ErrorKind::missing);
  message(folder.path(), ErrorKind::io);
  write_bytes(folder / "empty.hlt", std::vector<char>());
  message(folder / "empty.hlt", ErrorKind::format);
  write_bytes(folder / "text.hlt", std::vector<char>(1000, 'x'));
  EXPECT_NE(message(folder / "text.hlt", ErrorKind::format).find("not a Haarlight transport"),
            std::string::npos);
  const SmallTransport small = fixtures::small_transport(2, 8, 8, 9);
  write_file(small, folder / "a.hlt", all_tiles(small));
  auto bytes = bytes_of(folder / "a.hlt");
  bytes[8] = 99;
  write_bytes(folder / "newer.hlt", bytes);
  EXPECT_NE(message(folder / "newer.hlt", ErrorKind::format).find("version 99"), std::string::npos);
}

// A crafted file can carry right checksums; the structure of a chunk is checked on its own.
TEST(Chunk, StructureIsCheckedWithoutTheChecksum) {
  const HaarLayout layout(2);
  std::mt19937_64 random(10);
  const CompressedTile tile = compress_tile(layout, fixtures::random_tile(layout, random, 1, false),
                                            std::vector<float>{0.0f});
  const CompressedTile* tiles[] = {&tile};
  const std::vector<std::byte> right = assemble_chunk(layout, tiles);
  ASSERT_EQ(check_chunk(layout, right), "");
  const std::size_t area = column_area_begin(static_cast<std::size_t>(layout.size()));
  auto fewer_blocks = right;  // column 0 has bytes for four blocks and claims three
  ASSERT_EQ(fewer_blocks[area], std::byte{0x0f});
  fewer_blocks[area] = std::byte{0x07};
  EXPECT_NE(check_chunk(layout, fewer_blocks), "");
  auto no_number = right;  // the first scale becomes infinite
  no_number[area + 32] = std::byte{0x80};
  no_number[area + 33] = std::byte{0x7f};
  EXPECT_NE(check_chunk(layout, no_number), "");
  auto far = right;  // column 1 begins past the end
  far[kChunkHeaderBytes + 6] = std::byte{0x7f};
  EXPECT_NE(check_chunk(layout, far), "");
  EXPECT_NE(check_chunk(layout, std::span(right).first(right.size() - 16)), "");
}

TEST(TransportWriter, AFailedWriteKeepsTheOldFile) {
  const TemporaryFolder folder;
  const SmallTransport small = fixtures::small_transport(2, 8, 8, 9);
  write_file(small, folder / "a.hlt", all_tiles(small));
  const auto before = bytes_of(folder / "a.hlt");
  {
    TransportWriter writer(folder / "a.hlt", small.info, {small.thresholds, "test", false});
    writer.write_tile(0, small.tiles[0]);
    EXPECT_THROW(writer.finish("{}", {.progress = [](double) { return false; }}), Error);
  }
  EXPECT_EQ(bytes_of(folder / "a.hlt"), before);
  EXPECT_THROW(TransportWriter(folder / "no-such-folder/a.hlt", small.info,
                               {small.thresholds, "test", false}),
               Error);
}

TEST(ToleranceTuner, ThresholdsKeepTheErrorAndUseIt) {
  const HaarLayout layout(16);
  std::mt19937_64 random(4);
  std::vector<TileRows> tiles;
  for (int i = 0; i < 6; ++i) tiles.push_back(fixtures::random_tile(layout, random, 0.5, i % 2));
  float last = 0;
  for (const double error : {0.003, 0.01, 0.03, 0.1}) {
    ToleranceTuner tuner(layout, error);
    for (const auto& tile : tiles) tuner.add(tile);
    const auto thresholds = tuner.thresholds();
    ASSERT_EQ(thresholds.size(), 4u);
    EXPECT_GE(thresholds[0], last);
    last = thresholds[0];
  }
  EXPECT_GT(last, 0.0f);
  ToleranceTuner exact(layout, 0);
  exact.add(tiles[0]);
  EXPECT_EQ(exact.thresholds(), std::vector<float>(4, 0.0f));
  EXPECT_THROW(ToleranceTuner(layout, 1.5), Error);
  EXPECT_THROW(ToleranceTuner(layout, std::nan("")), Error);
}

}  // namespace
}  // namespace haarlight
