// Writes a small corpus for the fuzz targets: haarlight-fuzz-corpus DIR makes DIR/TARGET/*.

#include <fmt/format.h>

#include <filesystem>

#include "tests/fuzz/seeds.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "usage: haarlight-fuzz-corpus DIR\n");
    return 2;
  }
  const std::filesystem::path folder = argv[1];
  for (const auto& [target, seeds] : haarlight::fuzz::all_seeds()) {
    std::filesystem::create_directories(folder / target);
    int number = 0;
    for (const std::string& seed : seeds) {
      haarlight::write_bytes(folder / target / fmt::format("{:02}", number++), seed);
    }
  }
  return 0;
}
