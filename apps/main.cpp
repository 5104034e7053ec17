// The command-line program: picks a verb, runs it, turns failures into one line and an exit code.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <map>
#include <new>
#include <string>

#include "apps/interrupt.h"
#include "apps/option_parsers.h"
#include "apps/verbs.h"
#include "core/error.h"
#include "core/float_check.h"

namespace {

constexpr int kStatedError = 1;
constexpr int kWrongCommandLine = 2;

/// Messages are one line, whatever a library below put into them.
std::string one_line(std::string message) {
  while (!message.empty() && (message.back() == '\n' || message.back() == '.')) message.pop_back();
  std::replace(message.begin(), message.end(), '\n', ' ');
  return message;
}

int fail(int code, const std::string& message) {
  fmt::print(stderr, "haarlight: {}\n", one_line(message));
  return code;
}

struct VerbEntry {
  CLI::App* app;
  haarlight::Verb run;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Relights scenes under distant high-dynamic-range light, all frequencies, frame by frame:\n"
      "precomputed radiance transfer with incremental wavelet lighting."};
  app.name("haarlight");
  app.set_version_flag("--version", "haarlight " HAARLIGHT_VERSION);
  app.get_formatter()->column_width(34);
  app.get_formatter()->label("SUBCOMMAND", "VERB");
  app.get_formatter()->label("Subcommands", "Verbs");
  app.footer(
      "\nhaarlight VERB --help lists the options of a verb with units, ranges and defaults.\n"
      "Exit codes: 0 done; 1 a stated error, in one line; 2 a wrong command line.\n\n"
      "Examples:\n"
      "  haarlight precompute bunny.obj -o bunny.hlt\n"
      "  haarlight relight bunny.hlt --env lobby.exr --metrics m.csv --against-reference -o out");

  // The verbs, in the order of work.
  std::map<std::string, VerbEntry> verbs;
  std::vector<std::string> names;
  const auto add = [&](const std::string& name, const std::string& what,
                       haarlight::Verb (*add_options)(CLI::App&)) {
    CLI::App* verb = app.add_subcommand(name, what)->group("Verbs");
    verbs[name] = {verb, add_options(*verb)};
    names.push_back(name);
  };
  add("plan", "Says which effects a scene calls for, why, and what each costs",
      haarlight::add_plan);
  add("precompute",
      "Traces a scene's transport, for one view or a mesh's vertices, and writes it to a file",
      haarlight::add_precompute);
  add("compress", "Makes a mesh's transport smaller and faster: clustered PCA",
      haarlight::add_compress);
  add("relight", "Relights a transport file under a moving environment; pictures and metrics",
      haarlight::add_relight);
  add("animate", "Renders a scene that moves, frame by frame; pictures and metrics",
      haarlight::add_animate);
  add("compare", "Says how far apart two pictures are", haarlight::add_compare);
  add("merge", "Joins the shards of one precomputation", haarlight::add_merge);
  add("info", "Checks a transport file and says what is in it", haarlight::add_info);

  try {
    haarlight::check_float_arithmetic();
    if (argc > 1 && argv[1][0] != '-' && verbs.find(argv[1]) == verbs.end()) {
      return fail(kWrongCommandLine, fmt::format("unknown verb '{}', expected one of {}", argv[1],
                                                 haarlight::join_words(names, ", ")));
    }
    app.parse(argc, argv);
    const auto chosen = app.get_subcommands();
    if (chosen.empty()) {
      fmt::print(stderr, "{}", app.help());
      return kWrongCommandLine;
    }
    haarlight::catch_interrupts();
    verbs.at(chosen.front()->get_name()).run();
    return 0;
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    const auto chosen = app.get_subcommands();
    const std::string verb = chosen.empty() ? "" : " " + chosen.front()->get_name();
    return fail(kWrongCommandLine, fmt::format("{} (haarlight{} --help lists the options)",
                                               one_line(error.what()), verb));
  } catch (const haarlight::Error& error) {
    return fail(kStatedError, error.what());
  } catch (const haarlight::SilentFailure&) {
    return 0;  // the process that speaks returns 1; a second one would only make its starter speak
  } catch (const std::bad_alloc&) {
    return fail(kStatedError, "not enough memory for this size, expected more or a smaller size");
  } catch (const std::exception& error) {
    return fail(kStatedError, error.what());
  }
}
