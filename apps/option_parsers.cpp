// Parses option values; every refusal names the option, the value and what was wanted.

#include "apps/option_parsers.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/parallel.h"

namespace haarlight {
namespace {

constexpr int kMaxPictureSide = 8192;
constexpr int kMaxThreads = 1024;

template <typename T>
std::optional<T> whole_text_as(const std::string& text) {
  T value{};
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end || text.empty()) return std::nullopt;
  return value;
}

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (;;) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end - begin));
    if (end == std::string::npos) return parts;
    begin = end + 1;
  }
}

}  // namespace

void refuse_option(const std::string& option, const std::string& value, const std::string& wanted) {
  throw CLI::ValidationError(option, fmt::format("'{}', expected {}", value, wanted));
}

CLI::Option* add_integer(CLI::App& app, const std::string& name, int& target, int least, int most,
                         const std::string& help) {
  const auto parse = [name, &target, least, most](const std::string& text) {
    target = parse_integer(name, text, least, most);
  };
  return app
      .add_option_function<std::string>(name, parse,
                                        fmt::format("{}, {} to {} [{}]", help, least, most, target))
      ->type_name("N");
}

CLI::Option* add_number(CLI::App& app, const std::string& name, double& target, double least,
                        double most, const std::string& help) {
  const auto parse = [name, &target, least, most](const std::string& text) {
    target = parse_number(name, text, least, most);
  };
  return app
      .add_option_function<std::string>(name, parse,
                                        fmt::format("{}, {} to {} [{}]", help, least, most, target))
      ->type_name("X");
}

CLI::Option* add_path(CLI::App& app, const std::string& name, std::filesystem::path& target,
                      const std::string& type, const std::string& help) {
  const std::string shown = name.substr(name.rfind(',') + 1);
  const auto parse = [shown, &target](const std::string& text) {
    if (text.empty()) refuse_option(shown, text, "a name");
    target = text;
  };
  return app.add_option_function<std::string>(name, parse, help)->type_name(type);
}

CLI::Option* add_power_of_two(CLI::App& app, const std::string& name, int& target, int least,
                              int most, const std::string& help) {
  const auto parse = [name, &target, least, most](const std::string& text) {
    const std::optional<int> value = whole_text_as<int>(text);
    if (!value || *value < least || *value > most || (*value & (*value - 1)) != 0) {
      refuse_option(name, text, fmt::format("a power of two, {} to {}", least, most));
    }
    target = *value;
  };
  return app
      .add_option_function<std::string>(
          name, parse, fmt::format("{}, a power of two, {} to {} [{}]", help, least, most, target))
      ->type_name("N");
}

CLI::Option* add_threads(CLI::App& app) {
  const auto parse = [](const std::string& text) {
    set_thread_count(parse_integer("--threads", text, 1, kMaxThreads));
  };
  return app
      .add_option_function<std::string>(
          "--threads", parse,
          fmt::format("threads, 1 to {}; results do not depend on it [all cores]", kMaxThreads))
      ->type_name("N");
}

std::pair<int, int> parse_size(const std::string& option, const std::string& text) {
  const std::vector<std::string> parts = split(text, 'x');
  if (parts.size() == 2) {
    const std::optional<int> width = whole_text_as<int>(parts[0]);
    const std::optional<int> height = whole_text_as<int>(parts[1]);
    const auto fits = [](const std::optional<int>& side) {
      return side && *side >= 1 && *side <= kMaxPictureSide;
    };
    if (fits(width) && fits(height)) return {*width, *height};
  }
  refuse_option(option, text,
                fmt::format("WIDTHxHEIGHT in pixels, each 1 to {}, as 512x512", kMaxPictureSide));
}

std::vector<int> parse_frames(const std::string& option, const std::string& text, int most) {
  std::vector<int> frames;
  for (const std::string& part : split(text, ',')) {
    const std::optional<int> frame = whole_text_as<int>(part);
    if (!frame || *frame < 0 || *frame > most) {
      refuse_option(option, text, fmt::format("frames 0 to {} with commas between", most));
    }
    frames.push_back(*frame);
  }
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  return frames;
}

int parse_integer(const std::string& option, const std::string& text, int least, int most) {
  const std::optional<int> value = whole_text_as<int>(text);
  if (!value || *value < least || *value > most) {
    refuse_option(option, text, fmt::format("a whole number, {} to {}", least, most));
  }
  return *value;
}

double parse_number(const std::string& option, const std::string& text, double least, double most) {
  const std::optional<double> value = whole_text_as<double>(text);
  if (!value || !std::isfinite(*value) || *value < least || *value > most) {
    refuse_option(option, text, fmt::format("a number, {} to {}", least, most));
  }
  return *value;
}

std::uint64_t parse_byte_size(const std::string& option, const std::string& text) {
  std::string number = text;
  double unit = 1;
  const std::string units = "KMGT";
  if (!number.empty() && units.find(number.back()) != std::string::npos) {
    unit = std::exp2(10.0 * static_cast<double>(units.find(number.back()) + 1));
    number.pop_back();
  }
  const std::optional<double> value = whole_text_as<double>(number);
  if (!value || !std::isfinite(*value) || !(*value * unit >= 1) || *value * unit > 1e18) {
    refuse_option(option, text, "a size above 0 in bytes, or with K, M, G or T, as 200M or 1.5G");
  }
  return static_cast<std::uint64_t>(*value * unit);
}

std::vector<std::string> parse_words(const std::string& option, const std::string& text,
                                     const std::vector<std::string>& choices) {
  std::vector<std::string> words = split(text, ',');
  for (const std::string& word : words) {
    if (std::find(choices.begin(), choices.end(), word) == choices.end()) {
      refuse_option(option, text,
                    "one or more of " + join_words(choices, ", ") + " with commas between");
    }
  }
  return words;
}

std::string join_words(const std::vector<std::string>& words, const std::string& between) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : between) + word;
  return joined;
}

}  // namespace haarlight
