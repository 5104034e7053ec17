// haarlight compare: how far apart two pictures are.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/option_parsers.h"
#include "apps/verbs.h"
#include "core/image_io.h"
#include "core/image_metrics.h"
#include "prt/transport_difference.h"

namespace haarlight {
namespace {

struct CompareCommand {
  std::filesystem::path picture, reference;
  bool json = false;

  void run() const {
    if (picture.extension() == ".hlt" && reference.extension() == ".hlt") {
      compare_transports();
      return;
    }
    const Image a = load_image(picture);
    const Image b = load_image(reference);
    const ImageDifference difference = compare_images(a, b);
    if (json) {
      print_json(difference);
    } else {
      print_text(difference);
    }
  }

  // Two transports of the same rows under each built-in lighting: relative RMS of all rows.
  void compare_transports() const {
    const TransportDifference d =
        transport_difference(Transport::open(picture), Transport::open(reference));
    if (json) {
      nlohmann::ordered_json out;
      out["transport"] = picture.string();
      out["reference"] = reference.string();
      out["relative_rmse"] = d.relative_rmse;
      out["of_lightings"] = d.of_lightings;
      fmt::print("{}\n", out.dump(2));
      return;
    }
    fmt::print("relative rmse  {:.6g} (root mean square over {} built-in lightings)\n",
               d.relative_rmse, d.of_lightings.size());
    for (std::size_t l = 0; l < d.of_lightings.size(); ++l) {
      fmt::print("  lighting {}   {:.6g}\n", l + 1, d.of_lightings[l]);
    }
  }

  void print_json(const ImageDifference& d) const {
    nlohmann::ordered_json out;
    out["picture"] = picture.string();
    out["reference"] = reference.string();
    out["rmse"] = d.rmse;
    out["relative_rmse"] = d.relative_rmse;
    // JSON has no infinity: equal pictures have no PSNR there.
    out["psnr_db"] = std::isfinite(d.psnr) ? nlohmann::ordered_json(d.psnr) : nullptr;
    out["max_abs"] = d.max_abs;
    out["max_at"] = {d.max_x, d.max_y};
    fmt::print("{}\n", out.dump(2));
  }

  static void print_text(const ImageDifference& d) {
    fmt::print("rmse           {:.6g}\n", d.rmse);
    fmt::print("relative rmse  {:.6g}\n", d.relative_rmse);
    fmt::print("psnr           {}\n",
               std::isfinite(d.psnr) ? fmt::format("{:.2f} dB", d.psnr) : "infinite");
    fmt::print("largest        {:.6g} at pixel ({}, {})\n", d.max_abs, d.max_x, d.max_y);
  }
};

}  // namespace

Verb add_compare(CLI::App& verb) {
  auto command = std::make_shared<CompareCommand>();
  add_path(verb, "A", command->picture, "FILE", "picture: EXR, HDR, PNG, ...; or a transport")
      ->required();
  add_path(verb, "B", command->reference, "FILE",
           "reference picture of the same size; or a transport of the same rows")
      ->required();
  verb.add_flag("--json", command->json, "print JSON; the PSNR of equal pictures is null");
  verb.footer(
      "\nDifferences of linear values over all pixels and channels. Relative RMSE is RMSE over "
      "the\n"
      "root mean square of B; PSNR is against B's largest value. Transports (.hlt) are compared "
      "by\n"
      "the pictures they give under the built-in lightings, without background.\n\n"
      "Example:\n  haarlight compare out/pbi/frame_0075.exr out/reference/frame_0075.exr");
  return [command] { command->run(); };
}

}  // namespace haarlight
