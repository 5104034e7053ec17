#!/usr/bin/env python3
"""Instant caching and temporal instant caching against instant global illumination, as ratios.

  bench/instant_caching.py OUT_DIR [--bin build/bin] [--scenes cornell-bunny bunnies-9 ...]
                           [--frames 20] [--size 600x400] [--look 300x200] [--paths 256]

For each scene one run each of direct light alone, igi, ic and tic at --size. first.csv: milliseconds of
the first frame, whole and of diffuse reflections alone, and speedups of ic against igi (Debattista and
others 2009, Tables 1 and 2). motion.csv: the least time of the other frames, so that other work on the
machine counts little, speedups of tic against igi and ic (Tables 3 and 4), and the medians of how many
rays tic traces and saves. look.csv: LDR-FLIP, mean over pixels, of
the last frame at --look against igi and against a path tracer without box filter (in place of Table 5),
and how bright the picture is in the mean, of the paths'.
What OUT_DIR holds already is kept; start in an empty folder when the program has changed.
Needs numpy (Debian: python3-numpy).
"""
import argparse
import statistics
import sys
from pathlib import Path

import numpy as np

from caching import Failure, markdown, read_exr, rows_of, run, write
from perceptual import difference

METHODS = ["direct", "igi", "ic", "tic"]
# Of the papers; bunnies-N: N of nine bounce.
SCENES = ["cornell-bunny", "wobble", "desk", "bunnies-1", "bunnies-2", "bunnies-4", "bunnies-9", "office", "spheres",
          "cube-in-box"]


def animate(options, scene, method, name, *arguments):
    """Folder of frames and rows of metrics; made if it is not there."""
    file, folder = options.out / f"{scene}.glb", options.out / f"{scene}-{name}"
    if not file.exists():
        name_of, _, count = scene.partition("bunnies-")
        what = ["bunnies", "--count", count] if count else [name_of]
        run(options.bin / "haarlight-data", "animation", *what, "-o", file)
    if not (folder / "metrics.csv").exists():
        run(options.bin / "haarlight", "animate", file, "--method", method, "-o", folder, "--metrics",
            folder / "metrics.csv", *arguments)
    return folder, rows_of(folder / "metrics.csv")


def median(rows, column):
    return statistics.median(float(r[column]) for r in rows)


def least(rows, column):
    return min(float(r[column]) for r in rows)


def times(options):
    first, motion = [], []
    for scene in options.scenes:
        rows = {m: animate(options, scene, m, m, "--frames", options.frames, "--size", options.size)[1]
                for m in METHODS}
        start = {m: {c: float(rows[m][0][c]) for c in ("total_ms", "diffuse_ms")} for m in METHODS}
        first.append({"scene": scene, "triangles": rows["igi"][0]["triangles"],
                      **{f"{m}_ms": f"{start[m]['total_ms']:.0f}" for m in METHODS[:3]},
                      "speedup": f"{start['igi']['total_ms'] / start['ic']['total_ms']:.2f}",
                      **{f"{m}_diffuse_ms": f"{start[m]['diffuse_ms']:.0f}" for m in ("igi", "ic")},
                      "diffuse_speedup": f"{start['igi']['diffuse_ms'] / start['ic']['diffuse_ms']:.2f}"})
        later = {m: {**{c: least(rows[m][1:], c) for c in ("total_ms", "diffuse_ms")},
                     "rays": median(rows[m][1:], "rays")} for m in METHODS}
        saved = {c: median(rows["tic"][1:], c) for c in ("lights_changed", "records", "rays_moving", "rays_saved")}
        motion.append({
            "scene": scene, **{f"{m}_fps": f"{1e3 / later[m]['total_ms']:.2f}" for m in METHODS},
            "tic_igi": f"{later['igi']['total_ms'] / later['tic']['total_ms']:.2f}",
            **{f"{m}_diffuse_ms": f"{later[m]['diffuse_ms']:.1f}" for m in METHODS[1:]},
            "diffuse_tic_igi": f"{later['igi']['diffuse_ms'] / later['tic']['diffuse_ms']:.1f}",
            "diffuse_tic_ic": f"{later['ic']['diffuse_ms'] / later['tic']['diffuse_ms']:.2f}",
            **{f"{m}_rays": f"{later[m]['rays']:.0f}" for m in METHODS[1:]},
            **{c: f"{v:.0f}" for c, v in saved.items()}})
    return first, motion


def look(options):
    table = []
    for scene in options.scenes:
        last = options.frames - 1
        common = ["--size", options.look]
        name = f"frame_{last:04}.exr"
        pictures = {m: read_exr(animate(options, scene, m, f"{m}-look", "--frames", options.frames, *common)[0] / name)
                    for m in ("igi", "tic")}
        pictures["path"] = read_exr(animate(options, scene, "path", "path-look", "--first", last, "--frames", 1,
                                            "--filter", "none", "--spp", options.paths, *common)[0] / name)
        # One exposure, by the paths: their 95th percentile is white.
        white = np.percentile(pictures["path"].max(axis=2), 95)
        shown = {m: np.clip(p / white, 0, 1) for m, p in pictures.items()}
        row = {"scene": scene}
        for a, b in (("tic", "igi"), ("tic", "path"), ("igi", "path")):
            d = difference(shown[a], shown[b])
            row[f"{a}_{b}"] = f"{d.mean():.4f}"
            row[f"{a}_{b}_above_0.2"] = f"{100 * (d > 0.2).mean():.2f} %"
        row["tic_mean_to_path"] = f"{100 * pictures['tic'].mean() / pictures['path'].mean():.1f} %"
        table.append(row)
    return table


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--bin", type=Path, default=Path("build/bin"))
    parser.add_argument("--scenes", nargs="+", default=SCENES)
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--size", default="600x400")
    parser.add_argument("--look", default="300x200")
    parser.add_argument("--paths", type=int, default=256)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    try:
        first, motion = times(options)
        for name, table in (("first", first), ("motion", motion), ("look", look(options))):
            write(options.out / f"{name}.csv", table)
            print(f"\n{name}\n{markdown(table)}")
    except (Failure, OSError) as problem:
        print(f"instant_caching.py: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
