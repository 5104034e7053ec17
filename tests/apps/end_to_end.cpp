// The whole way through with the program itself: scene, transport, relit sequence, metrics.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "core/image_io.h"
#include "core/image_metrics.h"
#include "tests/apps/inputs.h"
#include "tests/apps/program_runner.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;
using fixtures::ProgramResult;
using fixtures::read_bytes;
using fixtures::read_table;
using fixtures::Table;
using Json = nlohmann::json;

constexpr const char* kHeader =
    "frame,method,wavelets,weight,updates,resets,lighting_error,image_rel_rmse,image_max_abs,"
    "update_ms,apply_ms,finish_ms,total_ms,bytes,flicker,error_estimate,error_bound,"
    "transport_error";
constexpr int kBands = 4;  // log2 of the face size, 16

class EndToEnd : public testing::Test {
 protected:
  fs::path path(const std::string& name) const { return folder_.path() / name; }

  std::string run(const std::vector<std::string>& arguments) const {
    const ProgramResult result = fixtures::run_program(arguments, folder_.path());
    EXPECT_EQ(result.code, 0) << result.err;
    return result.out;
  }

  void make_transport(const std::vector<std::string>& more = {}) const {
    fixtures::write_table_scene(path("table.obj"));
    save_image(path("room.exr"), fixtures::room_environment());
    std::vector<std::string> words{"precompute", "table.obj", "-o",     "table.hlt",
                                   "--size",     "64x64",     "--face", "16"};
    words.insert(words.end(), more.begin(), more.end());
    run(words);
  }

  /// Relights table.hlt and returns the metrics.
  Table relight(std::vector<std::string> more) const {
    std::vector<std::string> words{"relight", "table.hlt", "--metrics", "m.csv"};
    words.insert(words.end(), more.begin(), more.end());
    run(words);
    return read_table(path("m.csv"));
  }

  static double mean(const Table& table, const std::string& column, int first, int last) {
    double sum = 0;
    for (int i = first; i <= last; ++i) {
      sum += std::stod(table.rows.at(static_cast<std::size_t>(i)).at(column));
    }
    return sum / (last - first + 1);
  }

 private:
  fixtures::TemporaryFolder folder_;
};

TEST_F(EndToEnd, MetricsSayWhatTheMethodsPromise) {
  make_transport();
  const auto sequence = [&](const std::string& method) {
    return relight({"--env", "room.exr", "--method", method, "--frames", "46", "--stop", "30",
                    "--against-reference"});
  };
  const Table nwa = sequence("nwa"), pbi = sequence("pbi"), exact = sequence("reference");

  for (const Table* table : {&nwa, &pbi, &exact}) {
    EXPECT_EQ(table->header, kHeader);
    ASSERT_EQ(table->rows.size(), 46u);
    for (std::size_t i = 0; i < table->rows.size(); ++i) {
      const auto& row = table->rows[i];
      EXPECT_EQ(row.at("frame"), std::to_string(i));
      EXPECT_EQ(row.at("weight"), "area");
      EXPECT_EQ(row.at("resets").size(), static_cast<std::size_t>(kBands));
      EXPECT_EQ(row.at("resets").find_first_not_of("01"), std::string::npos);
      // Deciding and streaming are parts of the whole; printing rounds each to 5e-5 ms.
      EXPECT_LE(std::stod(row.at("update_ms")), std::stod(row.at("total_ms")) + 1e-4);
      EXPECT_LE(std::stod(row.at("apply_ms")), std::stod(row.at("total_ms")) + 1e-4);
    }
    // Frame 0 starts exact, to the rounding of a picture to float.
    EXPECT_EQ(std::stod(table->rows[0].at("lighting_error")), 0);
    EXPECT_LT(std::stod(table->rows[0].at("image_rel_rmse")), 1e-6);
    EXPECT_GT(std::stod(table->rows[0].at("bytes")), 0);
  }
  for (std::size_t i = 1; i < nwa.rows.size(); ++i) {
    EXPECT_EQ(nwa.rows[i].at("method"), "nwa");
    EXPECT_EQ(nwa.rows[i].at("wavelets"), "30");
    EXPECT_LE(std::stoi(nwa.rows[i].at("updates")), 30);
    EXPECT_LE(std::stoi(pbi.rows[i].at("updates")), 30);
    EXPECT_EQ(std::stod(exact.rows[i].at("lighting_error")), 0);
    EXPECT_LT(std::stod(exact.rows[i].at("image_rel_rmse")), 1e-6);
  }

  // Same budget: the temporally coherent method is nearer, in light and in the picture.
  EXPECT_LT(mean(pbi, "lighting_error", 1, 30), mean(nwa, "lighting_error", 1, 30));
  EXPECT_LT(mean(pbi, "image_rel_rmse", 1, 30), mean(nwa, "image_rel_rmse", 1, 30));
  // At rest NWA stays where it is, and PBI goes on converging.
  EXPECT_EQ(nwa.rows[32].at("lighting_error"), nwa.rows[45].at("lighting_error"));
  EXPECT_LT(mean(pbi, "lighting_error", 45, 45), 0.5 * mean(pbi, "lighting_error", 30, 30));
}

TEST_F(EndToEnd, AStillLightIsReachedExactlyAndThenNothingMoves) {
  make_transport();
  // 1536 coefficients at 400 a frame are all right after four frames, from dark as well.
  for (const char* method : {"bi", "pbi"}) {
    const Table table =
        relight({"--env", "room.exr", "--motion", "still", "--frames", "7", "--method", method,
                 "--wavelets", "400", "--from-dark", "--against-reference", "--weight", "none"});
    EXPECT_GT(std::stod(table.rows[0].at("lighting_error")), 0);
    EXPECT_GT(std::stod(table.rows[0].at("image_rel_rmse")), 1e-6);
    for (std::size_t i = 4; i < 7; ++i) {
      EXPECT_EQ(table.rows[i].at("updates"), "0");
      EXPECT_EQ(table.rows[i].at("resets"), std::string(kBands, '0'));
      EXPECT_EQ(table.rows[i].at("bytes"), "0");
      EXPECT_EQ(std::stod(table.rows[i].at("lighting_error")), 0);
      EXPECT_LT(std::stod(table.rows[i].at("image_rel_rmse")), 1e-6);
    }
  }
}

TEST_F(EndToEnd, ImageColumnsAreEmptyWithoutAReference) {
  make_transport();
  const Table table = relight({"--env", "room.exr", "--frames", "3"});
  ASSERT_EQ(table.rows.size(), 3u);
  for (const auto& row : table.rows) {
    EXPECT_EQ(row.at("image_rel_rmse"), "");
    EXPECT_EQ(row.at("image_max_abs"), "");
    EXPECT_FALSE(row.at("lighting_error").empty());
  }
}

TEST_F(EndToEnd, SavedPicturesAreThoseThatWereMeasured) {
  make_transport();
  const std::vector<std::string> common{
      "--env",         "room.exr", "--frames",  "12",  "--stop",          "8",
      "--save-frames", "0,7",      "--formats", "exr", "--no-background", "--against-reference"};
  std::vector<std::string> pbi{"-o", "pbi"}, exact{"-o", "exact", "--method", "reference"};
  pbi.insert(pbi.end(), common.begin(), common.end());
  exact.insert(exact.end(), common.begin(), common.end());
  relight(exact);
  const Table table = relight(pbi);

  EXPECT_FALSE(fs::exists(path("pbi/frame_0001.exr")));
  EXPECT_FALSE(fs::exists(path("pbi/frame_0000.png")));
  const Json said =
      Json::parse(run({"compare", "pbi/frame_0007.exr", "exact/frame_0007.exr", "--json"}));
  // Both printed from the same pixels; the table keeps nine digits.
  const double in_table = std::stod(table.rows[7].at("image_rel_rmse"));
  EXPECT_GT(in_table, 0);
  EXPECT_NEAR(said.at("relative_rmse").get<double>(), in_table, 1e-8 * in_table);
  EXPECT_NEAR(said.at("max_abs").get<double>(), std::stod(table.rows[7].at("image_max_abs")),
              1e-8 * said.at("max_abs").get<double>());
}

TEST_F(EndToEnd, ResultsDoNotDependOnTheNumberOfThreads) {
  make_transport({"--threads", "1"});
  const std::string one = read_bytes(path("table.hlt"));
  make_transport({"--threads", "7"});
  EXPECT_EQ(read_bytes(path("table.hlt")), one);
  std::string pictures[2], metrics[2];
  for (int i = 0; i < 2; ++i) {
    const Table table = relight({"--env", "room.exr", "--frames", "6", "--stop", "5", "-o", "out",
                                 "--save-frames", "5", "--threads", i == 0 ? "1" : "7"});
    for (const auto& row : table.rows) {
      metrics[i] += row.at("updates") + row.at("resets") + row.at("lighting_error") + "\n";
    }
    pictures[i] = read_bytes(path("out/frame_0005.exr"));
  }
  EXPECT_EQ(pictures[0], pictures[1]);
  EXPECT_EQ(metrics[0], metrics[1]);
}

TEST_F(EndToEnd, TheEnvironmentIsSeenBehindTheScene) {
  make_transport({"--ground", "off"});
  save_image(path("low.exr"), fixtures::constant_environment({0.25f, 0.5f, 1.0f}));
  save_image(path("high.exr"), fixtures::constant_environment({2.0f, 1.0f, 4.0f}));
  // The top left pixel is background: the framing camera looks down on the table.
  const auto corner = [&](const std::string& motion, int frame, bool background) {
    std::vector<std::string> words{"--env",  "low.exr", "--motion", motion, "--frames",  "9",
                                   "--stop", "8",       "-o",       "out",  "--formats", "exr"};
    if (motion == "blend") words.insert(words.end(), {"--env-to", "high.exr"});
    if (!background) words.push_back("--no-background");
    relight(words);
    return load_image(path("out/frame_000" + std::to_string(frame) + ".exr")).at(0, 0);
  };
  const auto expect_color = [](const Rgb& found, const Rgb& wanted) {
    // A few roundings of a float each.
    EXPECT_NEAR(found.r, wanted.r, 1e-5 * wanted.r);
    EXPECT_NEAR(found.g, wanted.g, 1e-5 * wanted.g);
    EXPECT_NEAR(found.b, wanted.b, 1e-5 * wanted.b);
  };
  EXPECT_EQ(corner("rotate", 4, false), (Rgb{0, 0, 0}));
  expect_color(corner("rotate", 4, true), {0.25f, 0.5f, 1.0f});
  expect_color(corner("still", 4, true), {0.25f, 0.5f, 1.0f});
  expect_color(corner("blend", 0, true), {0.25f, 0.5f, 1.0f});
  expect_color(corner("blend", 2, true), {0.6875f, 0.625f, 1.75f});  // t = 1/4
  expect_color(corner("blend", 8, true), {2.0f, 1.0f, 4.0f});
  EXPECT_TRUE(fs::exists(path("out/frame_0008.exr")));
  EXPECT_FALSE(fs::exists(path("out/frame_0008.png")));
}

TEST_F(EndToEnd, OneExposureServesTheWholeSequence) {
  make_transport();
  // Twice the light from the second environment: auto exposure must not take it back.
  save_image(path("low.exr"), fixtures::constant_environment({1, 1, 1}));
  save_image(path("high.exr"), fixtures::constant_environment({2, 2, 2}));
  relight({"--env", "low.exr", "--env-to", "high.exr", "--motion", "blend", "--frames", "2",
           "--stop", "1", "--method", "reference", "--tonemap", "linear", "-o", "out"});
  const Image dark = load_image(path("out/frame_0000.png"));
  const Image bright = load_image(path("out/frame_0001.png"));
  double sum[2] = {0, 0};
  for (std::size_t i = 0; i < dark.pixels.size(); ++i) {
    if (bright.pixels[i].g >= 0.99f) continue;  // clamped
    sum[0] += static_cast<double>(dark.pixels[i].g);
    sum[1] += static_cast<double>(bright.pixels[i].g);
  }
  EXPECT_GT(sum[0], 0);
  // Eight bits of sRGB: half a step is under 2 % of any value above 0.02, and less in the mean.
  EXPECT_NEAR(sum[1] / sum[0], 2.0, 0.05);
}

TEST_F(EndToEnd, CompareSaysWhatTheFormulasSay) {
  Image a(8, 4), b(8, 4);
  for (Rgb& pixel : b.pixels) pixel = {1, 1, 1};
  a = b;
  a.at(5, 2).g = 1.5f;
  save_image(path("a.exr"), a);
  save_image(path("b.exr"), b);
  const Json said = Json::parse(run({"compare", "a.exr", "b.exr", "--json"}));
  const double rmse = std::sqrt(0.25 / 96);  // one of 96 channels is off by 1/2
  EXPECT_NEAR(said.at("rmse").get<double>(), rmse, 1e-12);
  EXPECT_NEAR(said.at("relative_rmse").get<double>(), rmse, 1e-12);
  EXPECT_NEAR(said.at("psnr_db").get<double>(), -20 * std::log10(rmse), 1e-9);
  EXPECT_EQ(said.at("max_abs").get<double>(), 0.5);
  EXPECT_EQ(said.at("max_at"), Json({5, 2}));
  EXPECT_NE(run({"compare", "a.exr", "b.exr"}).find("at pixel (5, 2)"), std::string::npos);

  const Json same = Json::parse(run({"compare", "b.exr", "b.exr", "--json"}));
  EXPECT_EQ(same.at("rmse").get<double>(), 0);
  EXPECT_TRUE(same.at("psnr_db").is_null());
}

TEST_F(EndToEnd, InfoSaysWhatWasAskedFor) {
  make_transport();
  const Json info = Json::parse(run({"info", "table.hlt", "--json"}));
  EXPECT_EQ(info.at("width"), 64);
  EXPECT_EQ(info.at("height"), 64);
  EXPECT_EQ(info.at("face_size"), 16);
  EXPECT_EQ(info.at("coefficients"), 6 * 16 * 16);
  EXPECT_EQ(info.at("file_bytes"), fs::file_size(path("table.hlt")));
  EXPECT_EQ(info.at("rows"), 64 * 64);
  EXPECT_EQ(info.at("bands").size(), static_cast<std::size_t>(kBands));
  std::uint64_t in_bands = 0;
  for (const Json& band : info.at("bands")) in_bands += band.at("bytes").get<std::uint64_t>();
  const double mean_column = info.at("column_bytes").at("mean").get<double>();
  EXPECT_GT(in_bands, 0u);
  EXPECT_NEAR(mean_column * 6 * 16 * 16, static_cast<double>(in_bands), 0.5);
  EXPECT_LE(in_bands, info.at("chunk_bytes").get<std::uint64_t>());
  EXPECT_EQ(info.at("checksums"), "verified");
  const double error = info.at("made").at("measured_error").get<double>();
  EXPECT_GE(error, 0);
  EXPECT_LE(error, 0.01);  // the default of --error
  const std::string text = run({"info", "table.hlt"});
  for (const char* part : {"64x64 pixels", "6x16x16 texels", "measured error", "verified"}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

TEST_F(EndToEnd, AMeshIsRelitFromAnywhere) {
  make_transport({"--vertices", "--max-vertices", "3000", "--ground", "off"});
  const Json info = Json::parse(run({"info", "table.hlt", "--json"}));
  EXPECT_EQ(info.at("kind"), "mesh");
  EXPECT_GT(info.at("vertices"), 100);  // of 8 in the file
  EXPECT_LE(info.at("vertices"), 3000);
  EXPECT_EQ(info.at("rows"), info.at("vertices"));
  EXPECT_GT(info.at("triangles"), 4);
  EXPECT_NE(run({"info", "table.hlt"}).find("triangles"), std::string::npos);

  // The fixed view of the same camera shows the same, to interpolation and both compressions.
  const std::vector<std::string> still{"relight", "table.hlt", "--env",    "room.exr",  "--motion",
                                       "still",   "--frames",  "1",        "--formats", "exr",
                                       "-o",      "mesh",      "--method", "reference"};
  run(still);
  fs::rename(path("table.hlt"), path("mesh.hlt"));
  make_transport({"--ground", "off"});
  std::vector<std::string> of_image = still;
  of_image[11] = "image";
  run(of_image);
  const Image mesh = load_image(path("mesh") / "frame_0000.exr");
  const Image image = load_image(path("image") / "frame_0000.exr");
  EXPECT_LT(compare_images(mesh, image).relative_rmse, 0.1);

  // The camera goes half round while the light rests: a point-symmetric scene looks the same under
  // light that is the same all round.
  save_image(path("even.exr"), fixtures::constant_environment({1, 1, 1}));
  run({"relight",   "mesh.hlt", "--env", "even.exr", "--motion",  "still",    "--orbit",
       "180",       "--stop",   "2",     "--frames", "3",         "--size",   "50x40",
       "--formats", "exr",      "-o",    "round",    "--metrics", "round.csv"});
  const Image first = load_image(path("round") / "frame_0000.exr");
  const Image last = load_image(path("round") / "frame_0002.exr");
  EXPECT_EQ(first.width, 50);
  EXPECT_EQ(first.height, 40);
  EXPECT_LT(compare_images(first, last).relative_rmse, 0.05);
  const Table table = read_table(path("round.csv"));
  EXPECT_EQ(table.rows.at(2).at("updates"), "0");

  // Neither is for a fixed view.
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--orbit", "10"}, std::vector<std::string>{"--size", "8x8"}}) {
    std::vector<std::string> words = of_image;
    words.insert(words.end(), more.begin(), more.end());
    const ProgramResult refused = fixtures::run_program(words, path("."));
    EXPECT_EQ(refused.code, 2);
    EXPECT_NE(refused.err.find(more[0]), std::string::npos) << refused.err;
  }
}

TEST_F(EndToEnd, AnInterruptedPrecomputeIsResumedToTheSameFile) {
  fixtures::write_table_scene(path("table.obj"));
  // Enough rays for a signal to come in time.
  const auto words = [](const std::string& output, const std::vector<std::string>& more) {
    std::vector<std::string> all{"precompute", "table.obj", "-o",           output,
                                 "--size",     "128x128",   "--face",       "16",
                                 "--spp",      "16",        "--uniform-spp"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  fixtures::Program program(words("table.hlt", {}), path("."));
  // Some tiles in the journal, most of them still to come.
  const auto journal_bytes = [&] {
    std::error_code missing;
    const std::uintmax_t bytes = fs::file_size(path("table.hlt.partial"), missing);
    return missing ? 0 : bytes;
  };
  while (program.running() && journal_bytes() < 100'000) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  program.interrupt();
  const ProgramResult stopped = program.wait();
  ASSERT_EQ(stopped.code, 1) << stopped.err;
  EXPECT_NE(stopped.err.find("--resume"), std::string::npos) << stopped.err;
  EXPECT_TRUE(fs::exists(path("table.hlt.partial")));
  // What is there can be used, and says what it is.
  const Json info = Json::parse(run({"info", "table.hlt", "--json"}));
  EXPECT_EQ(info.at("made").at("complete"), false);
  EXPECT_GT(info.at("made").at("tiles_traced"), 0);
  EXPECT_LT(info.at("made").at("tiles_traced"), info.at("made").at("tiles"));

  const std::string said = run(words("table.hlt", {"--resume"}));
  EXPECT_NE(said.find("tiles were there already"), std::string::npos) << said;
  EXPECT_FALSE(fs::exists(path("table.hlt.partial")));
  const std::string afresh = run(words("whole.hlt", {}));
  EXPECT_EQ(afresh.find("tiles were there already"), std::string::npos) << afresh;
  EXPECT_EQ(read_bytes(path("table.hlt")), read_bytes(path("whole.hlt")));
}

}  // namespace
}  // namespace haarlight
