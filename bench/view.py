#!/usr/bin/env python3
"""Factored BRDFs: error against the number of terms, and pictures of the street against a path tracer.

  bench/view.py OUT_DIR --env A.exr --env B.exr [--bin build/bin] [--terms 4 16] [--samples 64]
                [--noise 0.02] [--paths 2048] [--width 320] [--height 200] [--split]
                [--images docs/images]

Writes OUT_DIR/curve.csv and curve.png (relative L2 error of a BRDF over both hemispheres against K),
makes haarlight-data's street with each number of terms, and writes pictures.csv: the relative RMSE of
its pictures under both lights from three views against a path tracer that shares no code with
precomputation, the tracer's noise taken off. strip.png has the views with few terms, with many, and the
reference. --split tells where the errors come from: split.csv has pictures of direct light alone, with few and many
terms, with the street's own vertices and with finer ones, and those under a light of 6x128x128. With --images both pictures are copied there as view_curve.png and view_strip.png.
What OUT_DIR holds already is kept; start in an empty folder when the program has changed.
Needs numpy and matplotlib (Debian: python3-numpy, python3-matplotlib).
"""
import argparse
import csv
import os
import shutil
import subprocess
import sys
from pathlib import Path

FACE = 32  # texels along a face of the lighting cube, as in Overbeck 2006, section 6.3


class Failure(Exception):
    """A message for the user, one line."""


def run(command, output=None):
    """Runs a program; its output becomes the file `output`, whole or not at all."""
    print("+", " ".join(str(c) for c in command), flush=True)
    done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE if output else None, text=True)
    if done.returncode != 0:
        raise Failure(f"{command[0]} ended with {done.returncode}")
    if output:
        partial = output.with_suffix(".partial")
        partial.write_text(done.stdout)
        partial.rename(output)


def rows_of(file):
    with open(file, newline="") as stream:
        return list(csv.DictReader(stream))


def draw_curve(file, picture):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    curves = {}
    for row in rows_of(file):
        curves.setdefault(row["material"], []).append((int(row["terms"]), float(row["error"])))
    figure, axes = plt.subplots(figsize=(7.2, 4.6), dpi=100)
    for name, points in curves.items():
        # An exact factorisation has no place on a logarithmic axis: it is drawn at its foot.
        axes.plot([k for k, _ in points], [max(e, 1e-3) for _, e in points], marker=".", label=name)
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    axes.set_xticks([1, 2, 4, 8, 16, 32, 64], labels=["1", "2", "4", "8", "16", "32", "64"])
    axes.set_ylim(9e-4, 1.1)
    axes.set_xlabel("K, terms")
    axes.set_ylabel("relative L2 error over both hemispheres")
    axes.grid(True, which="both", alpha=0.25)
    axes.legend(fontsize=7, loc="lower left")
    figure.tight_layout()
    figure.savefig(picture)


def draw_strip(folder, lights, terms, picture):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    names = [f"street{k}" for k in terms] + ["reference"]
    titles = [f"K = {k}" for k in terms] + ["path traced"]
    cells = [(light, view) for light in lights for view in range(3)]
    first = plt.imread(folder / f"{cells[0][0]}_0_reference.png")
    height, width = first.shape[:2]
    gap, text = 4, 20
    across = len(names) * (width + gap) + gap
    down = text + len(cells) * (height + gap)
    figure = plt.figure(figsize=(across / 100, down / 100), dpi=100, facecolor="white")
    for column, title in enumerate(titles):
        figure.text((gap + column * (width + gap)) / across, 1 - 15 / down, title, fontsize=9)
    for line, (light, view) in enumerate(cells):
        for column, name in enumerate(names):
            left = gap + column * (width + gap)
            top = text + line * (height + gap)
            axes = figure.add_axes([left / across, 1 - (top + height) / down, width / across, height / down])
            axes.imshow(plt.imread(folder / f"{light}_{view}_{name}.png"), interpolation="nearest")
            axes.set_axis_off()
    figure.savefig(picture)


MANY = 16  # terms


def split(options, out, scene):
    """Pictures of direct light, one thing after the other made better."""
    few = min(options.terms)
    made = {"few": (few, "off"), "many": (MANY, "off"), "fine": (MANY, "auto")}
    transports = {}
    for name, (terms, subdivide) in made.items():
        transports[name] = out / f"direct_{name}.hlt"
        if not transports[name].exists():
            run([options.bin / "haarlight", "precompute", scene, "-o", transports[name], "--vertices",
                 "--subdivide", subdivide, "--max-vertices", 400000, "--face", FACE, "--terms", terms,
                 "--effects", "shadows,gloss"])

    def compare(name, *more):
        table = out / f"split_{name}.csv"
        if not table.exists():
            run([options.bin / "haarlight-bench-view", "pictures", scene, *transports.values(), "-o", out / name,
                 "--width", options.width, "--height", options.height, "--samples", options.samples,
                 "--bounces", 0, "--env", *options.env, *more], table)
        errors = {}
        for row in rows_of(table):
            errors.setdefault((row["environment"], row["transport"]), []).append(float(row["relative_rmse"]))
        return {key: (sum(e * e for e in errors_) / len(errors_)) ** 0.5 for key, errors_ in errors.items()}

    same, sharp = compare("same"), compare("sharp", "--light-face", 128)
    print("\n| direct light: relative RMSE over three views | " + " | ".join(Path(e).stem for e in options.env) + " |")
    print("| --- |" + " --- |" * len(options.env))
    for title, errors, name in ((f"K = {few}", same, "few"), (f"K = {MANY}", same, "many"),
                                (f"K = {MANY}, finer vertices", same, "fine"),
                                (f"the last, against light of 6x128x128", sharp, "fine")):
        cells = [f"{100 * errors[(Path(e).stem, f'direct_{name}')]:.1f} %" for e in options.env]
        print(f"| {title} | " + " | ".join(cells) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--bin", type=Path, default=Path("build/bin"))
    parser.add_argument("--env", action="append", default=[], help="environment; twice")
    parser.add_argument("--terms", type=int, nargs="+", default=[4, 16])
    parser.add_argument("--samples", type=int, default=64, help="paths a pixel")
    parser.add_argument("--noise", type=float, default=0.02, help="of haarlight precompute")
    parser.add_argument("--paths", type=int, default=2048, help="of haarlight precompute")
    parser.add_argument("--width", type=int, default=320)
    parser.add_argument("--height", type=int, default=200)
    parser.add_argument("--split", action="store_true", help="where the errors come from")
    parser.add_argument("--images", type=Path, help="folder for copies of the pictures")
    options = parser.parse_args()
    out = options.out
    out.mkdir(parents=True, exist_ok=True)

    table = out / "lacquer.binary"
    if not table.exists():
        run([options.bin / "haarlight-data", "brdf", "-o", table])
    curve = out / "curve.csv"
    if not curve.exists():
        run([options.bin / "haarlight-bench-view", "curve", "--merl", table], curve)
    draw_curve(curve, out / "curve.png")
    by_material = {}
    for row in rows_of(curve):
        by_material.setdefault(row["material"], {})[int(row["terms"])] = float(row["error"])
    columns = (1, 4, 9, 16, 36, 64)
    print("\n| BRDF | " + " | ".join(f"K = {k}" for k in columns) + " |")
    print("| --- |" + " --- |" * len(columns))
    for name, errors in by_material.items():
        print(f"| {name} | " + " | ".join(f"{100 * errors[k]:.{0 if errors[k] >= 0.1 else 1}f} %" for k in columns) + " |")

    if options.env:
        scene = out / "street.glb"
        if not scene.exists():
            run([options.bin / "haarlight-data", "scene", "street", "-o", scene])
        transports = []
        for k in options.terms:
            transport = out / f"street{k}.hlt"
            if not transport.exists():
                run([options.bin / "haarlight", "precompute", scene, "-o", transport, "--vertices",
                     "--subdivide", "off", "--face", str(FACE), "--terms", str(k),
                     "--noise", options.noise, "--paths", options.paths,
                     "--effects", "shadows,interreflection,gloss,color"])
            transports.append(transport)
        pictures = out / "pictures.csv"
        if not pictures.exists():
            run([options.bin / "haarlight-bench-view", "pictures", scene, *transports, "-o", out,
                 "--width", options.width, "--height", options.height, "--samples", options.samples,
                 "--env", *options.env], pictures)
        all_rows = rows_of(pictures)
        print("\n| light | view | " + " | ".join(f"K = {k}" for k in options.terms) + " | noise of the reference |")
        print("| --- | --- |" + " --- |" * (len(options.terms) + 1))
        cells = {}
        for row in all_rows:
            cells.setdefault((row["environment"], row["view"]), []).append(row)
        for (light, view), rows in cells.items():
            errors = " | ".join(f"{100 * float(r['relative_rmse']):.1f} %" for r in rows)
            print(f"| {light} | {view} | {errors} | {100 * float(rows[0]['reference_noise']):.1f} % |")
        lights = [Path(e).stem for e in options.env]
        draw_strip(out, lights, options.terms, out / "strip.png")

        if options.split:
            split(options, out, scene)

    if options.images:
        shutil.copy(out / "curve.png", options.images / "view_curve.png")
        if options.env:
            shutil.copy(out / "strip.png", options.images / "view_strip.png")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Failure as failure:
        sys.exit(f"{os.path.basename(sys.argv[0])}: {failure}")
