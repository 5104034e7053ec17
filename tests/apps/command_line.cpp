// The program's help and what it says to a wrong command line.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/apps/program_runner.h"

namespace haarlight {
namespace {

using fixtures::ProgramResult;
using fixtures::run_program;
using fixtures::TemporaryFolder;

struct VerbOptions {
  std::string verb;
  std::vector<std::string> options;
};

const std::vector<VerbOptions> kVerbs{
    {"precompute",
     {"--output", "--view", "--size", "--face", "--spp", "--uniform-spp", "--pixel-samples",
      "--error", "--threads", "--resume", "--ground", "--terms", "--terms-error", "--merl"}},
    {"relight", {"--env",     "--output",   "--env-to",  "--projection",    "--motion",
                 "--degrees", "--frames",   "--stop",    "--method",        "--wavelets",
                 "--weight",  "--bands",    "--every",   "--from-dark",     "--save-frames",
                 "--metrics", "--exposure", "--tonemap", "--no-background", "--against-reference",
                 "--formats", "--threads"}},
    {"compare", {"--json"}},
    {"info", {"--json"}},
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// One line that starts with the program's name.
void expect_one_line(const std::string& message) {
  EXPECT_EQ(message.rfind("haarlight: ", 0), 0u) << message;
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
  EXPECT_EQ(message.back(), '\n') << message;
}

TEST(CommandLine, NoVerbListsTheVerbsAndIsAnError) {
  TemporaryFolder folder;
  const ProgramResult result = run_program({}, folder.path());
  EXPECT_EQ(result.code, 2);
  for (const VerbOptions& verb : kVerbs) EXPECT_TRUE(contains(result.err, "\n  " + verb.verb));
  EXPECT_TRUE(result.out.empty());
}

TEST(CommandLine, HelpNamesEveryVerbAndOption) {
  TemporaryFolder folder;
  const ProgramResult help = run_program({"--help"}, folder.path());
  EXPECT_EQ(help.code, 0);
  EXPECT_TRUE(contains(help.out, "Exit codes"));
  for (const VerbOptions& verb : kVerbs) {
    EXPECT_TRUE(contains(help.out, "\n  " + verb.verb)) << help.out;
    const ProgramResult more = run_program({verb.verb, "--help"}, folder.path());
    EXPECT_EQ(more.code, 0);
    EXPECT_TRUE(contains(more.out, "Example")) << more.out;
    for (const std::string& option : verb.options) {
      EXPECT_TRUE(contains(more.out, option)) << verb.verb << " " << option;
    }
  }
}

TEST(CommandLine, EveryOptionWithANumberSaysItsRangeAndDefault) {
  TemporaryFolder folder;
  for (const char* verb : {"precompute", "relight"}) {
    const std::string help = run_program({verb, "--help"}, folder.path()).out;
    std::size_t begin = 0;
    int seen = 0;
    while (begin < help.size()) {
      const std::size_t end = std::min(help.find('\n', begin), help.size());
      const std::string line = help.substr(begin, end - begin);
      begin = end + 1;
      const std::size_t option = line.find("  --");
      if (option != 0 || !(contains(line, " N ") || contains(line, " X "))) continue;
      // A long option pushes its text to the next line.
      const std::string text = line + help.substr(begin, help.find('\n', begin) - begin);
      EXPECT_TRUE(contains(text, " to ")) << text;
      EXPECT_TRUE(contains(text, "[")) << text;
      ++seen;
    }
    EXPECT_GE(seen, 4) << verb;
  }
}

TEST(CommandLine, VersionIsPrinted) {
  TemporaryFolder folder;
  const ProgramResult result = run_program({"--version"}, folder.path());
  EXPECT_EQ(result.code, 0);
  EXPECT_EQ(result.out.rfind("haarlight ", 0), 0u) << result.out;
}

struct WrongLine {
  std::vector<std::string> arguments;
  std::vector<std::string> said;  // the message holds each of these
};

std::vector<std::string> relight_with(std::vector<std::string> more) {
  std::vector<std::string> all{"relight", "a.hlt", "--env", "a.exr", "-o", "out"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

std::vector<std::string> precompute_with(std::vector<std::string> more) {
  std::vector<std::string> all{"precompute", "a.obj", "-o", "a.hlt"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

TEST(CommandLine, WrongOnesAreRefusedByNameWithTheChoices) {
  const std::vector<WrongLine> lines{
      {{"frobnicate"},
       {"'frobnicate'", "plan, precompute, compress, relight, animate, compare, merge, info"}},
      {{"--frobnicate"}, {"--frobnicate"}},
      {relight_with({"--frobnicate"}), {"--frobnicate"}},
      {relight_with({"extra.hlt"}), {"extra.hlt"}},
      {{"relight"}, {"required"}},
      {{"relight", "a.hlt", "-o", "out"}, {"--env", "required"}},
      {{"relight", "a.hlt", "--env", "a.exr"}, {"-o", "--metrics"}},
      {{"relight", "a.hlt", "--env", "", "-o", "out"}, {"--env", "''"}},
      {relight_with({"--method", "magic"}), {"--method", "'magic'", "nwa, bi, pbi, reference"}},
      {relight_with({"--weight", "x"}), {"--weight", "'x'", "none, area, transport"}},
      {relight_with({"--bands", "x"}), {"--bands", "'x'", "simple, exhaustive"}},
      {relight_with({"--motion", "x"}), {"--motion", "'x'", "still, rotate, tumble, swing, blend"}},
      {relight_with({"--motion", "blend"}), {"--env-to", "blend"}},
      {relight_with({"--env-to", "b.exr"}), {"--env-to", "'b.exr'", "rotate"}},
      {relight_with({"--projection", "x"}),
       {"--projection", "'x'", "auto, latlong, angular, vertical-cross"}},
      {relight_with({"--tonemap", "x"}), {"--tonemap", "'x'", "linear, reinhard, filmic"}},
      {relight_with({"--formats", "exr,gif"}), {"--formats", "'exr,gif'", "exr, png"}},
      {relight_with({"--frames", "0"}), {"--frames", "'0'", "1 to"}},
      {relight_with({"--frames", "many"}), {"--frames", "'many'", "1 to"}},
      {relight_with({"--frames", "99999999999"}), {"--frames", "'99999999999'"}},
      {relight_with({"--frames"}), {"--frames"}},
      {relight_with({"--stop", "0"}), {"--stop", "'0'"}},
      {relight_with({"--wavelets", "0"}), {"--wavelets", "'0'", "1 to"}},
      {relight_with({"--wavelets", "3.5"}), {"--wavelets", "'3.5'"}},
      {relight_with({"--degrees", "nan"}), {"--degrees", "'nan'"}},
      {relight_with({"--degrees", "90deg"}), {"--degrees", "'90deg'"}},
      {relight_with({"--exposure", "bright"}), {"--exposure", "'bright'"}},
      {relight_with({"--threads", "0"}), {"--threads", "'0'"}},
      {relight_with({"--save-frames", "0,x"}), {"--save-frames", "'0,x'"}},
      {relight_with({"--save-frames", "0,130"}), {"--save-frames", "'0,130'", "0 to 129"}},
      {relight_with({"--save-frames", "0", "--every", "2"}), {"--save-frames", "--every"}},
      {{"relight", "a.hlt", "--env", "a.exr", "--metrics", "m.csv", "--every", "2"}, {"-o"}},
      {{"precompute", "a.obj"}, {"--output", "required"}},
      {precompute_with({"--size", "512"}), {"--size", "'512'", "512x512", "8192"}},
      {precompute_with({"--size", "0x512"}), {"--size", "'0x512'"}},
      {precompute_with({"--size", "512x8193"}), {"--size", "'512x8193'"}},
      {precompute_with({"--face", "48"}), {"--face", "'48'", "power of two"}},
      {precompute_with({"--face", "100000"}), {"--face", "'100000'"}},
      {precompute_with({"--spp", "0"}), {"--spp", "'0'"}},
      {precompute_with({"--error", "-0.1"}), {"--error", "'-0.1'"}},
      {precompute_with({"--error", "nan"}), {"--error", "'nan'"}},
      {precompute_with({"--view", "top"}), {"--view", "'top'", "auto, scene, framing"}},
      {precompute_with({"--ground", "maybe"}), {"--ground", "'maybe'", "auto, on, off"}},
      {precompute_with({"--pixel-samples", "2"}), {"--pixel-samples", "'2'", "1, 4, 16"}},
      {{"compare", "a.exr"}, {"required"}},
      {{"info"}, {"required"}},
  };
  TemporaryFolder folder;
  for (const WrongLine& line : lines) {
    std::string shown;
    for (const std::string& word : line.arguments) shown += word + " ";
    SCOPED_TRACE(shown);
    const ProgramResult result = run_program(line.arguments, folder.path());
    EXPECT_EQ(result.code, 2);
    EXPECT_TRUE(result.out.empty());
    expect_one_line(result.err);
    for (const std::string& part : line.said) {
      EXPECT_TRUE(contains(result.err, part)) << "'" << part << "' in " << result.err;
    }
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "out"));
}

}  // namespace
}  // namespace haarlight
