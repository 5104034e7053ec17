// The text of metrics files, and that they appear whole or not at all.

#include "prt/metrics_csv.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "core/error.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

FrameMetrics measured() {
  FrameMetrics m;
  m.frame = 30;
  m.method = LightingMethod::bi;
  m.wavelets = 60;
  m.weight = WaveletWeight::transport;
  m.updates = 59;
  m.resets = "010010";
  m.lighting_error = 0.125;
  m.image_rel_rmse = 0.5;
  m.image_max_abs = 1e-7;
  m.update_ms = 0.25;
  m.apply_ms = 1.5;
  m.finish_ms = 0.0625;
  m.total_ms = 2;
  m.bytes = 12345678901;
  m.flicker = 0.25;
  m.error_estimate = 0.0625;
  m.error_bound = 2;
  m.transport_error = 0.01;
  return m;
}

TEST(MetricsCsv, HeaderNamesTheColumns) {
  EXPECT_EQ(metrics_csv_header(),
            "frame,method,wavelets,weight,updates,resets,lighting_error,image_rel_rmse,"
            "image_max_abs,update_ms,apply_ms,finish_ms,total_ms,bytes,flicker,error_estimate,"
            "error_bound,"
            "transport_error");
}

TEST(MetricsCsv, RowsHoldWhatWasMeasuredAndNothingElse) {
  FrameMetrics m = measured();
  EXPECT_EQ(metrics_csv_row(m),
            "30,bi,60,transport,59,010010,0.125,0.5,1e-07,0.2500,1.5000,0.0625,2.0000,12345678901,"
            "0.25,0.0625,2,0.01");
  m.image_rel_rmse.reset();
  m.image_max_abs.reset();
  m.flicker.reset();
  m.error_estimate.reset();
  m.error_bound.reset();
  m.transport_error.reset();
  EXPECT_EQ(metrics_csv_row(m),
            "30,bi,60,transport,59,010010,0.125,,,0.2500,1.5000,0.0625,2.0000,12345678901,,,,");
}

TEST(MetricsCsv, ErrorsSurviveAsFloats) {
  FrameMetrics m = measured();
  for (const float error : {0.1f, 1.0f / 3, 3.4e-12f, 16777215.0f}) {
    m.lighting_error = static_cast<double>(error);
    std::string row = metrics_csv_row(m);
    for (int column = 0; column < 6; ++column) row.erase(0, row.find(',') + 1);
    EXPECT_EQ(std::stof(row), error) << row;
  }
}

TEST(MetricsCsv, AFileAppearsOnCommitOnly) {
  const fixtures::TemporaryFolder folder;
  const auto file = folder / "m.csv";
  {
    MetricsCsvWriter writer(file);
    writer.add(measured());
    EXPECT_FALSE(std::filesystem::exists(file));
    writer.commit();
  }
  EXPECT_EQ(text_of(file), metrics_csv_header() + "\n" + metrics_csv_row(measured()) + "\n");
  {
    MetricsCsvWriter writer(file);
    writer.add(measured());
    writer.add(measured());
  }
  EXPECT_EQ(text_of(file), metrics_csv_header() + "\n" + metrics_csv_row(measured()) + "\n");
  const std::filesystem::directory_iterator all(folder.path());
  EXPECT_EQ(std::distance(begin(all), end(all)), 1);
}

TEST(MetricsCsv, APlaceThatCannotBeWrittenIsKnownAtOnce) {
  const fixtures::TemporaryFolder folder;
  try {
    MetricsCsvWriter writer(folder / "nowhere" / "m.csv");
    FAIL() << "expected an Error";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::io);
    EXPECT_NE(std::string(error.what()).find("m.csv"), std::string::npos);
  }
}

}  // namespace
}  // namespace haarlight
