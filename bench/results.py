#!/usr/bin/env python3
"""Measures what docs/results.md states, with the program itself, and prints it as Markdown.

  bench/results.py DATA_DIR OUT_DIR [--bin build/bin]

DATA_DIR holds meshes/stanford-bunny.obj and environments/{lobby,interior,forest}.exr,
noon_grass_1k.hdr, leadenhall_market_1k.hdr. What OUT_DIR holds already is kept.
"""
import argparse
import csv
import json
import os
import resource
import subprocess
import sys


ENVIRONMENTS = ("forest", "interior", "lobby", "leadenhall", "noon_grass")


def run(*command):
    return subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, text=True).stdout


def mean(values):
    values = list(values)
    return sum(values) / len(values)


class Study:
    def __init__(self, args):
        self.data, self.out, self.bin = args.data, args.out, args.bin
        os.makedirs(self.out, exist_ok=True)
        self.haarlight = os.path.join(self.bin, "haarlight")
        self.bunny = os.path.join(self.data, "meshes/stanford-bunny.obj")

    def environment(self, name):
        folder = os.path.join(self.data, "environments")
        return next(os.path.join(folder, f) for f in sorted(os.listdir(folder)) if f.startswith(name))

    def transport(self, name, *options):
        """Path, and the peak memory in MiB of the run that made it (kept beside it)."""
        path = os.path.join(self.out, name + ".hlt")
        note = path + ".peak"
        if not os.path.exists(note):
            run(self.haarlight, "precompute", self.bunny, "-o", path, "--effects", "shadows", *options)
            peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
            with open(note, "w") as f:
                f.write(f"{peak:.0f}")
        with open(note) as f:
            return path, float(f.read())

    def info(self, path):
        return json.loads(run(self.haarlight, "info", path, "--json"))

    def sequence(self, transport, environment, method, wavelets, *options):
        path = os.path.join(self.out, "metrics.csv")
        run(self.haarlight, "relight", transport, "--env", self.environment(environment),
            "--motion", "rotate", "--method", method, "--wavelets", wavelets, "--metrics", path,
            *options)
        with open(path) as f:
            return list(csv.DictReader(f))

    def transport_size(self):
        path, peak = self.transport("bunny512", "--size", "512x512", "--error", "0.01")
        size = os.path.getsize(path) / 2**20
        measured = find(self.info(path), "measured_error")
        print("| bunny on its ground, 512x512, 6x64x64, `--error 0.01` | |\n| --- | --- |")
        print(f"| file | {size:.0f} MiB |\n| peak memory of precompute | {peak:.0f} MiB |")
        print(f"| error measured while writing, worst built-in lighting | {100 * measured:.2f} % |\n")
        return path

    def lighting_errors(self, transport):
        print("| method | frames 1-99, mean | frame 110 | frame 124 | frames 60-99, mean |")
        print("| --- | --- | --- | --- | --- |")
        cases = [("nwa", k) for k in (30, 60, 100, 300, 500)] + [("bi", 30), ("pbi", 30), ("pbi", 100)]
        for method, wavelets in cases:
            rows = self.sequence(transport, "lobby", method, wavelets)
            error = [float(r["lighting_error"]) for r in rows]
            print(f"| {method.upper()}-{wavelets} | {mean(error[1:100]):.3f} | {error[110]:.3f} |"
                  f" {error[124]:.3f} | {mean(error[60:100]):.3f} |")
        print()

    def band_choice(self, transport):
        """The simple per-band test against the exhaustive search (Overbeck 2006, Figure 7, inset)."""
        print("| PBI-30, mean lighting error, frames 1-99 | simple | exhaustive | simple / exhaustive |"
              " resets, coarsest band first |")
        print("| --- | --- | --- | --- | --- |")
        ratios = []
        for environment in ENVIRONMENTS:
            rows = {bands: self.sequence(transport, environment, "pbi", 30, "--bands", bands)
                    for bands in ("simple", "exhaustive")}
            error = {b: mean(float(r["lighting_error"]) for r in rows[b][1:100]) for b in rows}
            resets = [sum(int(r["resets"][b]) for r in rows["simple"][1:]) for b in range(6)]
            ratios.append(error["simple"] / error["exhaustive"])
            print(f"| {environment} | {error['simple']:.4f} | {error['exhaustive']:.4f} |"
                  f" {ratios[-1]:.3f} | {' '.join(map(str, resets))} |")
        print(f"| mean | | | {mean(ratios):.3f} | |\n")

    def weights(self, transport):
        print("| PBI-30, mean picture error, frames 1-99 | none | area | transport | area / transport |")
        print("| --- | --- | --- | --- | --- |")
        for environment in ("lobby", "interior"):
            error = {}
            for weight in ("none", "area", "transport"):
                rows = self.sequence(transport, environment, "pbi", 30, "--weight", weight,
                                     "--against-reference")
                error[weight] = mean(float(r["image_rel_rmse"]) for r in rows[1:100])
            print(f"| {environment} | {error['none']:.4f} | {error['area']:.4f} |"
                  f" {error['transport']:.4f} | {error['area'] / error['transport']:.2f} |")
        print()

    def still(self, transport):
        """A light that rests long enough: is the picture the reference's, and are updates empty?"""
        for method in ("bi", "pbi"):
            rows = self.sequence(transport, "lobby", method, 300, "--frames", 260, "--stop", 99,
                                 "--against-reference")
            last = rows[-1]
            first_empty = next((int(r["frame"]) for r in rows[100:] if r["updates"] == "0"), None)
            print(f"{method.upper()}-300 after the light rests at frame 99: picture error "
                  f"{float(last['image_rel_rmse']):.1e} in frame {last['frame']}, "
                  f"first empty update in frame {first_empty}.")
        print()

    def compression(self):
        coarse, _ = self.transport("bunny128", "--size", "128x128", "--error", "0.01")
        exact, _ = self.transport("bunny128_exact", "--size", "128x128", "--error", "0")
        print("| picture error of compression, 128x128 | as loaded | turned by 37 degrees |")
        print("| --- | --- | --- |")
        for environment in ENVIRONMENTS:
            cells = []
            folders = []
            for path in (coarse, exact):
                folder = os.path.join(self.out, "compare", os.path.basename(path))
                folders.append(folder)
                run(self.haarlight, "relight", path, "--env", self.environment(environment),
                    "--method", "reference", "--degrees", 37, "--stop", 1, "--frames", 2,
                    "--no-background", "--formats", "exr", "-o", folder)
            for frame in ("frame_0000.exr", "frame_0001.exr"):
                text = run(self.haarlight, "compare", os.path.join(folders[0], frame),
                           os.path.join(folders[1], frame), "--json")
                cells.append(f"{100 * find(json.loads(text), 'relative_rmse'):.2f} %")
            print(f"| {environment} | {cells[0]} | {cells[1]} |")
        print()

    def bench(self, transport):
        print("```")
        sys.stdout.flush()
        text = run(os.path.join(self.bin, "haarlight-bench"), "--transport", transport, "--env",
                   self.environment("lobby"), "--scene", self.bunny, "--benchmark_color=false")
        print(text[text.index("Ratios"):].rstrip() + "\n```")


def find(tree, key):
    """The first value under `key` anywhere in a JSON tree."""
    if isinstance(tree, dict):
        if key in tree:
            return tree[key]
        tree = list(tree.values())
    if isinstance(tree, list):
        for branch in tree:
            value = find(branch, key)
            if value is not None:
                return value
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data")
    parser.add_argument("out")
    parser.add_argument("--bin", default="build/bin")
    study = Study(parser.parse_args())
    transport = study.transport_size()
    study.lighting_errors(transport)
    study.band_choice(transport)
    study.weights(transport)
    study.still(transport)
    study.compression()
    study.bench(transport)


if __name__ == "__main__":
    main()
