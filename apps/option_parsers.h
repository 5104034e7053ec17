// Command line options that say their unit, range and default, and refuse a bad value by name.

#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace haarlight {

/// Throws the error that makes the program return 2: "--frames: 'x', expected a whole number".
[[noreturn]] void refuse_option(const std::string& option, const std::string& value,
                                const std::string& wanted);

/// Each adds an option that is parsed into `target`, which must outlive the parse. `help` says what
/// it is, in what unit; range and default (the value of `target` now) are added to it.
CLI::Option* add_integer(CLI::App& app, const std::string& name, int& target, int least, int most,
                         const std::string& help);
CLI::Option* add_number(CLI::App& app, const std::string& name, double& target, double least,
                        double most, const std::string& help);
CLI::Option* add_path(CLI::App& app, const std::string& name, std::filesystem::path& target,
                      const std::string& type, const std::string& help);

/// A power of two in [least, most].
CLI::Option* add_power_of_two(CLI::App& app, const std::string& name, int& target, int least,
                              int most, const std::string& help);

/// One of a few words.
template <typename T>
CLI::Option* add_choice(CLI::App& app, const std::string& name, T& target,
                        const std::vector<std::pair<std::string, T>>& choices,
                        const std::string& help);

/// --threads, set at once through set_thread_count().
CLI::Option* add_threads(CLI::App& app);

/// "512x384" -> {512, 384}, both 1 to 8192.
std::pair<int, int> parse_size(const std::string& option, const std::string& text);
/// "0,30,75" -> ascending, without repeats; each 0 to `most`.
std::vector<int> parse_frames(const std::string& option, const std::string& text, int most);
/// A finite number in [least, most]; all of the text must be it.
double parse_number(const std::string& option, const std::string& text, double least, double most);
/// A whole number in [least, most]; all of the text must be it.
int parse_integer(const std::string& option, const std::string& text, int least, int most);
/// "200M" -> 209715200: a positive number with K, M, G or T (powers of 1024) or without.
std::uint64_t parse_byte_size(const std::string& option, const std::string& text);
/// "exr,png" -> the words, each one of `choices`.
std::vector<std::string> parse_words(const std::string& option, const std::string& text,
                                     const std::vector<std::string>& choices);

// Implementation of the template.

std::string join_words(const std::vector<std::string>& words, const std::string& between);

template <typename T>
CLI::Option* add_choice(CLI::App& app, const std::string& name, T& target,
                        const std::vector<std::pair<std::string, T>>& choices,
                        const std::string& help) {
  std::vector<std::string> words;
  std::string chosen;
  for (const auto& [word, value] : choices) {
    words.push_back(word);
    if (value == target) chosen = word;
  }
  const auto parse = [name, &target, choices, words](const std::string& text) {
    for (const auto& [word, value] : choices) {
      if (word == text) {
        target = value;
        return;
      }
    }
    refuse_option(name, text, "one of " + join_words(words, ", "));
  };
  return app.add_option_function<std::string>(name, parse, help + " [" + chosen + "]")
      ->type_name(join_words(words, "|"));
}

}  // namespace haarlight
