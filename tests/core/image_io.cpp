// Picture files: what is written comes back, and nothing damaged comes in.

#include "core/image_io.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <thread>

#include "core/error.h"
#include "tests/core/temporary_folder.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

Image noise(int width, int height) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 3);
  Image image(width, height);
  for (Rgb& p : image.pixels) p = {uniform(random), uniform(random), uniform(random)};
  return image;
}

/// The error of a call that must throw one; one line that begins with the file's name.
template <typename Call>
ErrorKind kind_of(const fs::path& file, const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    const std::string what = error.what();
    EXPECT_EQ(what.rfind(file.string() + ": ", 0), 0u) << what;
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    return error.kind();
  }
  ADD_FAILURE() << file << ": no error";
  return ErrorKind::cancelled;
}
ErrorKind load_error(const fs::path& file) {
  return kind_of(file, [&] { load_image(file); });
}

TEST(ImageIo, ExrKeepsEveryFloat) {
  const TemporaryFolder folder;
  Image image = noise(33, 7);
  image.at(0, 0) = {-67.7f, 1e30f, std::numeric_limits<float>::denorm_min()};
  image.at(1, 0) = {std::numeric_limits<float>::infinity(), 65504.0f * 4, -0.0f};
  image.at(2, 0).g = std::numeric_limits<float>::quiet_NaN();
  save_image(folder / "a.exr", image);
  const Image back = load_image(folder / "a.exr");
  ASSERT_EQ(back.width, 33);
  ASSERT_EQ(back.height, 7);
  EXPECT_TRUE(std::isnan(back.at(2, 0).g)) << "the gate is elsewhere";
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    if (i == 2) continue;
    EXPECT_EQ(back.pixels[i], image.pixels[i]) << i;
  }
}

TEST(ImageIo, DataIsNotDecodedAndAlphaIsKept) {
  const TemporaryFolder folder;
  Image image(2, 1);
  image.pixels = {{1, 0.25f, 0}, {0.5f, 0.5f, 0.5f}};
  save_image(folder / "a.png", image);
  // 0.25 is 137 and 0.5 is 188 of 255 in sRGB.
  const Image data = load_image(folder / "a.png", ImageEncoding::data);
  EXPECT_NEAR(data.pixels[0].g, 137 / 255.0f, 1e-6f);
  EXPECT_NEAR(data.pixels[1].r, 188 / 255.0f, 1e-6f);
  EXPECT_NEAR(load_image(folder / "a.png").pixels[1].r, 0.5f, 0.005f);
  EXPECT_TRUE(load_alpha(folder / "a.png").empty());
  save_image(folder / "a.exr", image);
  EXPECT_EQ(load_image(folder / "a.exr", ImageEncoding::data).pixels, image.pixels);
  // A TGA of two pixels, blue green red alpha, from the top left. Colours are not darkened.
  std::string tga(18, '\0');
  tga[2] = 2, tga[12] = 2, tga[14] = 1, tga[16] = 32, tga[17] = 0x28;
  for (const int byte : {0, 0, 255, 255, 255, 0, 0, 51}) tga += static_cast<char>(byte);
  std::ofstream(folder / "a.tga", std::ios::binary) << tga;
  EXPECT_EQ(load_image(folder / "a.tga").pixels[1], (Rgb{0, 0, 1}));
  const std::vector<float> alpha = load_alpha(folder / "a.tga");
  ASSERT_EQ(alpha.size(), 2u);
  EXPECT_EQ(alpha[0], 1);
  EXPECT_NEAR(alpha[1], 0.2f, 1e-6f);
  EXPECT_EQ(kind_of(folder / "none.png", [&] { load_alpha(folder / "none.png"); }),
            ErrorKind::missing);
}

// RGBE: a common exponent and 8 bits, cut off: a channel is low by less than 2^-7 of the largest
// (the largest's mantissa is in [128, 256)), or off by half of that with rounding.
TEST(ImageIo, HdrKeepsSevenBits) {
  const TemporaryFolder folder;
  const Image image = noise(40, 9);
  save_image(folder / "a.hdr", image);
  const Image back = load_image(folder / "a.hdr");
  ASSERT_EQ(back.pixels.size(), image.pixels.size());
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const Rgb& p = image.pixels[i];
    const float step = std::max({p.r, p.g, p.b}) / 128;
    const Rgb d = back.pixels[i] - p;
    EXPECT_LE(std::max({std::abs(d.r), std::abs(d.g), std::abs(d.b)}), step) << i;
  }
}

// sRGB by IEC 61966-2-1, written out here from the standard: c = 12.92 x up to 0.0031308, else
// 1.055 x^(1/2.4) - 0.055. Mid grey 0.214041 is byte 127.5, and so on.
TEST(ImageIo, PngIsSrgbAndClamps) {
  const TemporaryFolder folder;
  Image image(256, 2);
  for (int x = 0; x < 256; ++x) {
    const double encoded = x / 255.0;
    const auto linear = static_cast<float>(
        encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4));
    image.at(x, 0) = {linear, linear / 2, 0};
  }
  image.at(0, 1) = {-3, 7, std::numeric_limits<float>::quiet_NaN()};
  save_image(folder / "a.png", image);
  const Image back = load_image(folder / "a.png");
  ASSERT_EQ(back.width, 256);
  for (int x = 0; x < 256; ++x) {
    // The exact value of a byte comes back as that byte: rounding of float and pow only.
    EXPECT_NEAR(back.at(x, 0).r, image.at(x, 0).r, 1e-6f) << x;
    // Half a step of 1/255, by the steepest slope of the decoding curve, 2.4 / 1.055 at white.
    EXPECT_NEAR(back.at(x, 0).g, image.at(x, 0).g, 0.5 / 255 * 2.4 / 1.055 + 1e-6) << x;
    EXPECT_EQ(back.at(x, 0).b, 0) << x;
  }
  EXPECT_EQ(back.at(0, 1), Rgb(0, 1, 0));
}

TEST(ImageIo, EqualPicturesGiveEqualBytes) {
  const TemporaryFolder folder;
  const Image image = noise(20, 20);
  const auto named = [&](const char* name, const char* suffix) {
    return folder / (std::string(name) + suffix);
  };
  constexpr std::array kSuffixes = {".exr", ".hdr", ".png"};
  for (const char* suffix : kSuffixes) save_image(named("a", suffix), image);
  // Long enough for another time stamp.
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  for (const char* suffix : kSuffixes) {
    save_image(named("b", suffix), image);
    EXPECT_TRUE(read_bytes(named("a", suffix)) == read_bytes(named("b", suffix))) << suffix;
  }
}

// A grey picture in the plainest format there is: portable grey map, 8 bits.
TEST(ImageIo, OneChannelIsCopiedToThree) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.pgm", std::string("P5\n2 1\n255\n") + '\x00' + '\xff');
  const Image image = load_image(folder / "a.pgm");
  ASSERT_EQ(image.pixels.size(), 2u);
  EXPECT_EQ(image.pixels[0], Rgb(0, 0, 0));
  EXPECT_EQ(image.pixels[1], Rgb(1, 1, 1));
}

TEST(ImageIo, FirstRowIsTheTop) {
  const TemporaryFolder folder;
  write_bytes(folder / "a.ppm", std::string("P6\n1 2\n255\n\xff\x00\x00\x00\x00\xff", 17));
  const Image image = load_image(folder / "a.ppm");
  ASSERT_EQ(image.height, 2);
  EXPECT_EQ(image.at(0, 0), Rgb(1, 0, 0));
  EXPECT_EQ(image.at(0, 1), Rgb(0, 0, 1));
}

TEST(ImageIo, EveryTruncationIsRefused) {
  const TemporaryFolder folder;
  const Image image = noise(24, 20);
  for (const char* suffix : {".exr", ".hdr"}) {
    save_image(folder / (std::string("whole") + suffix), image);
    const std::string bytes = read_bytes(folder / (std::string("whole") + suffix));
    const fs::path cut = folder / (std::string("cut") + suffix);
    for (std::size_t length = 0; length < bytes.size(); length += length < 400 ? 7 : 41) {
      write_bytes(cut, bytes.substr(0, length));
      EXPECT_EQ(load_error(cut), ErrorKind::format) << length << " of " << bytes.size();
    }
    write_bytes(cut, bytes.substr(0, bytes.size() - 1));
    EXPECT_EQ(load_error(cut), ErrorKind::format) << suffix << " without its last byte";
  }
}

// Whose file it is its first bytes say; the name only where they do not. One reader is asked: what
// it refuses no other is tried on.
TEST(ImageIo, PicturesAreReadByTheirContent) {
  const TemporaryFolder folder;
  const Image image = noise(5, 3);
  for (const char* name : {"a.exr", "a.hdr", "a.png"}) {
    save_image(folder / name, image);
    const Image right = load_image(folder / name);
    for (const char* other : {"b.exr", "b.hdr", "b.png", "b.jpg", "b.tga", "b"}) {
      write_bytes(folder / other, read_bytes(folder / name));
      EXPECT_EQ(load_image(folder / other).pixels, right.pixels) << name << " as " << other;
    }
  }
  // A PNG's first bytes before an EXR's: the reader of PNG refuses it, with its reason.
  write_bytes(folder / "c.exr", "\x89PNG" + read_bytes(folder / "a.exr").substr(4));
  try {
    load_image(folder / "c.exr");
    FAIL() << "taken";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("PNG"), std::string::npos) << error.what();
  }
}

TEST(ImageIo, WhatIsNoPictureIsRefused) {
  const TemporaryFolder folder;
  EXPECT_EQ(load_error(folder / "nothing.exr"), ErrorKind::missing);
  EXPECT_EQ(load_error(folder.path()), ErrorKind::format);
  for (const char* name : {"text.exr", "text.hdr", "text", "text.obj"}) {
    write_bytes(folder / name, "v 0 0 0\nnot a picture\n");
    EXPECT_EQ(load_error(folder / name), ErrorKind::format) << name;
  }
  write_bytes(folder / "empty.exr", "");
  EXPECT_EQ(load_error(folder / "empty.exr"), ErrorKind::format);
  // A header that promises 10^10 pixels, with none behind it.
  write_bytes(folder / "huge.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 100000\n");
  EXPECT_EQ(load_error(folder / "huge.hdr"), ErrorKind::format);
  // One that may be, but not in 60 bytes: refused before 3 GiB are asked for.
  write_bytes(folder / "large.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16000 +X 16000\n");
  EXPECT_EQ(load_error(folder / "large.hdr"), ErrorKind::format);
}

std::string refusal(const fs::path& file, const std::string& bytes) {
  write_bytes(file, bytes);
  try {
    load_image(file);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::format);
    return error.what();
  }
  return {};
}

// Readers that take the room for all pixels before they say how many there are, up to 16 GiB.
TEST(ImageIo, PicturesOfMoreThanTheirBytesAreRefusedFirst) {
  const TemporaryFolder folder;
  const std::string webp("RIFF\0\0\0\0WEBPVP8", 15);
  const auto chunk = [&](std::string rest) { return webp + rest.append(9, '\0'); };
  const std::pair<std::string, const char*> refused[] = {
      // Progressive, behind a segment of another kind and a filling byte.
      {std::string("\xff\xd8\xff\xe0\0\4ab\xff\xff\xc2\0\x11\x8\xff\xff\xff\xfe\3", 19),
       "65534x65535"},
      {std::string("BM").append(16, '\0').append("\0\0\1\0\0\0\xff\xff", 8), "65536x65536"},
      {chunk(std::string("L\0\0\0\0\x2f\xff\xff\xff\xff", 10)), "16384x16384"},
      {chunk(std::string("X\0\0\0\0\0\0\0\0\xff\xff\3\xff\xff\0", 15)), "262144x65536"},
      {chunk(std::string(" \0\0\0\0\0\0\0\x9d\1\x2a\xff\xff\xff\xff", 15)), "16383x16383"}};
  for (const auto& [bytes, size] : refused) {
    const std::string said = refusal(folder / "a.png", bytes);
    EXPECT_NE(said.find(fmt::format("a.png: has {} pixels in", size)), std::string::npos) << said;
  }
}

// Where an attribute takes more or less than it says, the next would be read from the middle of
// something: its length may be 2 GiB.
TEST(ImageIo, AttributesThatTakeWhatTheyDoNotSayAreRefused) {
  const TemporaryFolder folder;
  save_image(folder / "a.exr", Image(4, 4));
  const std::string whole = read_bytes(folder / "a.exr");
  EXPECT_EQ(refusal(folder / "b.exr", whole), "");
  for (const std::string kind : {"chlist", "compression", "box2i", "lineOrder", "float", "v2f"}) {
    for (const int change : {-1, 1}) {
      std::string bytes = whole;
      const std::size_t length = bytes.rfind('\0' + kind + '\0') + kind.size() + 2;
      ASSERT_LT(length, bytes.size()) << kind;
      bytes[length] = static_cast<char>(bytes[length] + change);
      const std::string said = refusal(folder / "b.exr", bytes);
      EXPECT_NE(said.find("b.exr: is damaged: a " + kind + " takes "), std::string::npos) << said;
    }
  }
  // A string of 2 GiB in a list of eight bytes; a preview of 4 GiB in eight.
  for (const auto& [kind, value] :
       {std::pair<std::string, std::string>{"stringvector", "\xff\xff\xff\x7f-abc"},
        {"preview", std::string("\0\x80\0\0\0\x80\0\0", 8)}}) {
    const std::string bytes = whole.substr(0, 8) + "x" + '\0' + kind + '\0' +
                              std::string("\x8\0\0\0", 4) + value + whole.substr(8);
    const std::string said = refusal(folder / "b.exr", bytes);
    EXPECT_NE(said.find("b.exr: is damaged: a " + kind + " takes "), std::string::npos) << said;
  }
}

// Films, and pictures that make their readers fall, are left to other programs.
TEST(ImageIo, OtherFormatsAreNotTried) {
  const TemporaryFolder folder;
  const std::string gif("GIF8ressionf\0v\0\x1f", 16);
  EXPECT_NE(refusal(folder / "a.gif", gif).find("expected EXR, HDR"), std::string::npos);
  EXPECT_NE(refusal(folder / "a.mp4", gif).find("expected EXR, HDR"), std::string::npos);
  EXPECT_NE(refusal(folder / "a.exr", gif), "");
}

TEST(ImageIo, SavingRefusesWhatItCannotDoAndLeavesNothing) {
  const TemporaryFolder folder;
  const Image image = noise(4, 4);
  const auto save_error = [](const fs::path& file, const Image& picture) {
    return kind_of(file, [&] { save_image(file, picture); });
  };
  EXPECT_EQ(save_error(folder / "a.jpg", image), ErrorKind::invalid_argument);
  EXPECT_EQ(save_error(folder / "a", image), ErrorKind::invalid_argument);
  EXPECT_EQ(save_error(folder / "a.exr", Image()), ErrorKind::invalid_argument);
  Image wrong(4, 4);
  wrong.pixels.pop_back();
  EXPECT_EQ(save_error(folder / "a.exr", wrong), ErrorKind::invalid_argument);
  EXPECT_EQ(save_error(folder / "missing" / "a.exr", image), ErrorKind::io);
  EXPECT_EQ(folder.entries(), Names{});
  save_image(folder / "A.EXR", image);
  EXPECT_EQ(folder.entries(), Names{"A.EXR"});
}

}  // namespace
}  // namespace haarlight
