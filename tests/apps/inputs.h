// Small inputs that the tests of the program write for it.

#pragma once

#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/image.h"
#include "core/image_io.h"
#include "tests/apps/program_runner.h"

namespace haarlight::fixtures {

/// A floor of 2 x 2 m and a smaller board above it that shades it.
inline void write_table_scene(const std::filesystem::path& file) {
  write_bytes(file,
              "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\n"
              "v -0.5 0.6 -0.5\nv 0.5 0.6 -0.5\nv 0.5 0.6 0.5\nv -0.5 0.6 0.5\n"
              "f 1 4 3\nf 1 3 2\nf 5 8 7\nf 5 7 6\n");
}

/// Lat-long radiance of one value everywhere.
inline Image constant_environment(const Rgb& radiance) {
  Image picture(64, 32);
  for (Rgb& pixel : picture.pixels) pixel = radiance;
  return picture;
}

/// A dim room with structure at several sizes and three lamps of different colours and heights, so
/// that thirty wavelets are far too few for it.
inline Image room_environment() {
  Image picture(128, 64);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const double u = (x + 0.5) / picture.width * 6.283185307179586;
      const double v = (y + 0.5) / picture.height * 3.141592653589793;
      const double wall = 0.6 + 0.2 * std::sin(3 * u) + 0.15 * std::sin(11 * u + 5 * v) +
                          0.1 * std::sin(29 * u - 17 * v);
      const double tint = 0.5 + 0.5 * std::cos(2 * u + v);
      picture.at(x, y) = {static_cast<float>(wall), static_cast<float>(0.8 * wall),
                          static_cast<float>(wall * tint)};
    }
  }
  const auto lamp = [&](int x, int y, const Rgb& radiance) {
    for (int j = 0; j < 2; ++j) {
      for (int i = 0; i < 2; ++i) picture.at(x + i, y + j) += radiance;
    }
  };
  lamp(20, 10, {60, 50, 40});
  lamp(70, 16, {30, 30, 40});
  lamp(101, 25, {10, 40, 15});
  return picture;
}

/// A metrics file: the names of its columns, and its rows as text by name.
struct Table {
  std::string header;
  std::vector<std::map<std::string, std::string>> rows;
};

inline std::vector<std::string> split_line(const std::string& line, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t end = 0; end != std::string::npos; begin = end + 1) {
    end = line.find(separator, begin);
    parts.push_back(line.substr(begin, end - begin));
  }
  return parts;
}

inline Table read_table(const std::filesystem::path& file) {
  std::istringstream stream(read_bytes(file));
  Table table;
  std::getline(stream, table.header);
  const std::vector<std::string> names = split_line(table.header, ',');
  for (std::string line; std::getline(stream, line);) {
    const std::vector<std::string> fields = split_line(line, ',');
    if (fields.size() != names.size()) throw std::runtime_error("ragged row: " + line);
    std::map<std::string, std::string> row;
    for (std::size_t i = 0; i < names.size(); ++i) row[names[i]] = fields[i];
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace haarlight::fixtures
