#!/usr/bin/env python3
"""What accuracy costs in time: runs scenes, lights, motions, methods and budgets, and draws curves.

    bench/curves.py DATA_DIR OUT_DIR [--quick | --full] [--bin build/bin]

DATA_DIR holds meshes/ and environments/ as scripts/fetch_data.sh leaves them; what is missing there
is left out. OUT_DIR gets transports, runs/*.csv (one a run; kept, so that a run that was cut off goes
on), summary.csv, *.png next to the figures of Overbeck 2006, and curves.html, one file with all of it.
All numbers come from haarlight and haarlight-study; this script adds up and draws. --quick takes one
scene of 128x128 pixels and one light, a few minutes; --full takes all and about a day.

Errors and times are measured in runs of their own: relighting exactly beside a method would take the
caches from it. Needs numpy and matplotlib (Debian: python3-numpy, python3-matplotlib).
"""

import argparse
import base64
import csv
import html
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

STOP, FRAMES = 99, 130
ENVIRONMENTS = ("lobby", "interior", "forest", "leadenhall", "noon_grass")
MOTIONS = ("rotate", "tumble", "swing", "blend", "light")
SCENES = {"bunny": "meshes/stanford-bunny.obj", "teapot": "meshes/teapot.obj", "plant": None}
NEAR = 1.5  # an estimate is near if it is within this factor of the error
COLOURS = {"nwa": "C0", "bi": "C1", "pbi": "C2", "pbi exhaustive": "C3", "pbi transport": "C4",
           "nwa transport": "C5", "bi transport": "C8", "sh5": "C6", "sh10": "C7", "sh10i": "C9"}


class Case:
    """One sequence: what runs, under what."""

    def __init__(self, scene, env, motion, method, wavelets=None, weight="area", bands="simple",
                 ms=None, error=None, terms=None):
        self.scene, self.env, self.motion, self.method = scene, env, motion, method
        self.wavelets, self.weight, self.bands = wavelets, weight, bands
        self.ms, self.error, self.terms = ms, error, terms

    @property
    def family(self):
        """The line in a plot that this case is a point of."""
        if self.method.startswith("sh"):
            return self.method
        name = self.method
        if self.bands == "exhaustive":
            name += " exhaustive"
        if self.weight != "area":
            name += " " + self.weight
        if self.ms:
            name += " by time"
        if self.error:
            name += " by error"
        return name

    @property
    def budget(self):
        if self.ms:
            return f"{self.ms:g} ms"
        if self.error:
            return f"{100 * self.error:g} %"
        if self.method == "reference":
            return "all"
        return str(self.wavelets or self.terms or "all")

    @property
    def key(self):
        parts = [self.scene, self.env, self.motion, self.family, self.budget]
        return "_".join(parts).replace(" ", "-").replace("%", "pc")


class Study:
    def __init__(self, args):
        self.args = args
        self.out, self.data, self.bin = Path(args.out), Path(args.data), Path(args.bin)
        self.runs = self.out / "runs"
        self.runs.mkdir(parents=True, exist_ok=True)
        self.begun, self.done, self.planned = time.time(), 0, 0

    # Running programs.

    def program(self, name, *arguments):
        command = [str(self.bin / name), *map(str, arguments)]
        result = subprocess.run(command, capture_output=True, text=True)
        if result.returncode:
            sys.exit(f"curves.py: {' '.join(command)}\n{result.stderr.strip()}")
        return result.stdout

    def note(self, text):
        print(f"[{time.time() - self.begun:6.0f} s] {text}", flush=True)

    def environment(self, name):
        folder = self.data / "environments"
        found = sorted(f for f in folder.glob(name + "*") if f.suffix in (".exr", ".hdr")) \
            if folder.is_dir() else []
        return found[0] if found else None

    def lights(self):
        found = [name for name in ENVIRONMENTS if self.environment(name)]
        if not found:
            sys.exit(f"curves.py: no environment of {', '.join(ENVIRONMENTS)} in "
                     f"{self.data}/environments, wanted at least one")
        return found

    def scenes(self):
        return [s for s, f in SCENES.items() if f is None or (self.data / f).exists()]

    def transport(self, scene):
        size = self.args.size
        path = self.out / f"{scene}_{size}.hlt"
        if path.exists():
            return path
        source = self.data / SCENES[scene] if SCENES[scene] else self.out / f"{scene}.glb"
        if SCENES[scene] is None and not source.exists():
            self.program("haarlight-data", "scene", scene, "-o", source)
        self.note(f"precompute {scene}, {size}x{size}")
        effects = "shadows" if SCENES[scene] else "shadows,color"
        self.program("haarlight", "precompute", source, "-o", path, "--effects", effects,
                     "--size", f"{size}x{size}", "--spp", 2 if SCENES[scene] is None else 4)
        return path

    def light_options(self, case):
        options = ["--env", self.environment(case.env), "--motion", case.motion,
                   "--frames", FRAMES, "--stop", STOP]
        if case.motion == "blend":
            others = [e for e in self.lights() if e != case.env]
            options += ["--env-to", self.environment(others[0] if others else case.env)]
        return options

    def run(self, case, timed=False, pictures=()):
        """Rows of a case; `timed`: its times alone, without a reference beside it."""
        suffix = ".time.csv" if timed else ".csv"
        path = self.runs / (case.key + suffix)
        folder = self.out / "frames" / case.key
        have = all((folder / f"frame_{f:04}.png").exists() for f in pictures)
        if not path.exists() or not have:
            transport = self.transport(case.scene)
            if case.method.startswith("sh"):
                options = ["sh", transport, "--order", case.method[2:].rstrip("i"), "-o", path]
                if case.terms:
                    options += ["--terms", case.terms]
                self.program("haarlight-study", *options, *self.light_options(case))
            else:
                options = ["--method", case.method, "--weight", case.weight, "--bands", case.bands,
                           "--metrics", path]
                if case.ms:
                    options += ["--budget-ms", case.ms]
                elif case.error:
                    options += ["--target-error", case.error]
                elif case.wavelets:
                    options += ["--wavelets", case.wavelets]
                options += ["--no-estimate"] if timed else ["--against-reference"]
                if pictures:
                    options += ["-o", folder, "--formats", "png", "--save-frames",
                                ",".join(map(str, pictures))]
                self.program("haarlight", "relight", transport, *options, *self.light_options(case))
            count = f"{self.done + 1}/{self.planned} " if self.planned else ""
            self.note(f"{count}{case.key}{' (times)' if timed else ''}")
        self.done += 1
        with open(path, newline="") as f:
            rows = list(csv.DictReader(f))
        return Rows(rows)

    # What is run.

    def cases(self):
        budgets = (3, 10, 30, 100, 300, 1000) if self.args.quick else \
            (1, 3, 10, 30, 60, 100, 300, 500, 1000)
        scenes = self.scenes()[:1] if self.args.quick else self.scenes()
        lights = self.lights()[:1] if self.args.quick else self.lights()
        motions = MOTIONS[:1] if self.args.quick else MOTIONS
        for scene in scenes:
            for env in lights:
                for motion in motions:
                    at = (scene, env, motion)
                    for k in budgets:
                        for method in ("nwa", "bi", "pbi"):
                            yield Case(*at, method, k)
                            if method == "pbi" or not self.args.quick:
                                yield Case(*at, method, k, weight="transport")
                        yield Case(*at, "pbi", k, bands="exhaustive")
                        if not self.args.quick:
                            yield Case(*at, "pbi", k, weight="none")
                    for error in (0.03, 0.01):
                        yield Case(*at, "pbi", error=error, weight="transport")
                    yield Case(*at, "reference")
                    yield Case(*at, "sh5")
                    yield Case(*at, "sh10")
                    for terms in (6, 25):
                        yield Case(*at, "sh10i", terms=terms)

    def figure_cases(self):
        at = self.front()
        return [Case(*at, m, k) for m, k in
                (("nwa", 30), ("nwa", 60), ("nwa", 100), ("nwa", 300), ("nwa", 500), ("bi", 30),
                 ("pbi", 30), ("pbi", 100))]

    def front(self):
        return self.scenes()[0], self.lights()[0], "rotate"

    def measure(self):
        cases = list(self.cases())
        # Times of reference and spherical harmonics are those of their only run.
        self.planned = sum(1 if case.method.startswith("sh") else 2 for case in cases)
        table = []
        for case in cases:
            rows = self.run(case)
            timed = rows if case.method.startswith("sh") else self.run(case, timed=True)
            table.append(summary_of(case, rows, timed))
            write_csv(self.out / "summary.csv", table)
        self.planned = 0  # what follows draws, and runs little
        return table


class Rows:
    """The columns of a metrics file as arrays."""

    def __init__(self, rows):
        self.rows = rows
        self.frame = np.array([int(r["frame"]) for r in rows])

    def __getitem__(self, name):
        return np.array([float(r[name]) if r[name] else np.nan for r in self.rows])

    def resets(self):
        return np.array([[int(c) for c in r["resets"]] for r in self.rows]).T


def quantiles(values):
    values = values[np.isfinite(values)]
    return np.quantile(values, (0.1, 0.5, 0.9)) if len(values) else np.full(3, np.nan)


def summary_of(case, rows, timed):
    moving = (rows.frame >= 1) & (rows.frame <= STOP)
    error, estimate, bound = rows["image_rel_rmse"], rows["error_estimate"], rows["error_bound"]
    judged = moving & (error > 1e-6) & np.isfinite(estimate)
    ratio = estimate[judged] / error[judged]
    low, median, high = quantiles(error[moving])
    fast, ms, slow = quantiles(timed["total_ms"][moving])
    return {
        "scene": case.scene, "env": case.env, "motion": case.motion, "family": case.family,
        "method": case.method, "weight": case.weight, "bands": case.bands, "budget": case.budget,
        "wavelets": float(np.mean(rows["updates"][moving])),
        "error": float(np.mean(error[moving])), "error_p10": low, "error_p50": median,
        "error_p90": high, "error_104": error[104], "error_124": error[124],
        "lighting_error": float(np.mean(rows["lighting_error"][moving])),
        "flicker": float(np.mean(rows["flicker"][moving])),
        "ms_p10": fast, "ms": ms, "ms_p90": slow,
        "mib": float(np.mean(rows["bytes"][moving])) / 2**20,
        "judged": int(judged.sum()),
        "near": int(np.sum((ratio < NEAR) & (ratio > 1 / NEAR))),
        "bound_broken": int(np.sum(bound < error)),
        "bound_over_error": float(np.median(bound[judged] / error[judged])) if judged.any() else np.nan,
    }


def write_csv(path, table):
    temporary = path.with_suffix(".tmp")
    with open(temporary, "w", newline="") as f:
        writer = csv.DictWriter(f, list(table[0]))
        writer.writeheader()
        writer.writerows(table)
    os.replace(temporary, path)


# Drawing.


def pyplot():
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    plt.rcParams.update({"figure.dpi": 110, "font.size": 9, "axes.grid": True, "grid.alpha": 0.25,
                         "axes.spines.top": False, "axes.spines.right": False})
    return plt


def families(table):
    names = []
    for row in table:
        if row["family"] not in names:
            names.append(row["family"])
    return {name: [r for r in table if r["family"] == name] for name in names}


def front_curves(axis, table, x, y, low, high):
    for i, (name, points) in enumerate(families(table).items()):
        if name == "reference":
            continue
        points = sorted(points, key=lambda r: r[x])
        xs, ys = [r[x] for r in points], [max(r[y], 1e-7) for r in points]
        colour = COLOURS.get(name, f"C{i % 10}")
        marker = "s" if name.startswith("sh") else "^" if "by" in name else "o"
        axis.plot(xs, ys, marker=marker, ms=4, lw=1.4, color=colour, label=name,
                  ls="--" if "exhaustive" in name else "-")
        if low:
            axis.fill_between(xs, [max(r[low], 1e-7) for r in points],
                              [max(r[high], 1e-7) for r in points], color=colour, alpha=0.10, lw=0)
    axis.set_xscale("log")
    axis.set_yscale("log")
    if x == "ms":  # less than two decades
        from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
        axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.xaxis.set_minor_formatter(NullFormatter())


def draw_fronts(table, at, file):
    """Pareto fronts: what error a time, a number of wavelets, buys."""
    plt = pyplot()
    rows = [r for r in table if (r["scene"], r["env"], r["motion"]) == at]
    figure, axes = plt.subplots(1, 3, figsize=(15, 5), constrained_layout=True)
    front_curves(axes[0], rows, "ms", "error_p50", "error_p10", "error_p90")
    axes[0].set_xlabel("milliseconds a frame (median)")
    axes[0].set_ylabel("picture error (relative RMS): median, shade 10 to 90 % of frames")
    exact = [r for r in rows if r["method"] == "reference"]
    if exact:
        axes[0].axvline(exact[0]["ms"], color="0.4", ls=":", lw=1)
        axes[0].annotate("exact", (exact[0]["ms"], axes[0].get_ylim()[1]), (-3, -3), rotation=90,
                         textcoords="offset points", ha="right", va="top", color="0.4")
    front_curves(axes[1], rows, "wavelets", "error_p50", "error_p10", "error_p90")
    axes[1].set_xlabel("wavelets (or harmonics) a frame")
    axes[1].set_ylabel("picture error")
    front_curves(axes[2], [r for r in rows if np.isfinite(r["flicker"])], "ms", "flicker", None, None)
    axes[2].set_xlabel("milliseconds a frame (median)")
    axes[2].set_ylabel("flicker (mean)")
    axes[1].legend(frameon=False, fontsize=8)
    figure.suptitle(f"{at[0]} under {at[1]}, {at[2]}, frames 1 to {STOP}")
    figure.savefig(file)
    plt.close(figure)


def draw_over_time(study, file):
    """Overbeck 2006, Figure 7 with its inset; below, the same of the picture, and flicker."""
    plt = pyplot()
    at = study.front()
    figure, axes = plt.subplots(3, 1, figsize=(10, 12), sharex=True, constrained_layout=True)
    runs = {}
    for case in study.figure_cases():
        runs[f"{case.method.upper()}-{case.wavelets}"] = study.run(case)
    for i, (label, rows) in enumerate(runs.items()):
        for axis, column in zip(axes, ("lighting_error", "image_rel_rmse", "flicker")):
            values = rows[column]
            axis.plot(rows.frame[1:], values[1:], color=f"C{i}", lw=1.4, label=label)
    axes[0].set_ylabel("lighting error (area-weighted L1, relative)")
    axes[1].set_ylabel("picture error (relative RMS)")
    axes[2].set_ylabel("flicker")
    axes[2].set_xlabel("frame")
    axes[1].set_yscale("log")
    axes[1].set_ylim(bottom=1e-5)
    axes[2].set_yscale("log")
    axes[2].set_ylim(bottom=1e-6)
    for axis in axes:
        axis.axvline(STOP, color="0.5", lw=1, ls="--")
    axes[0].legend(frameon=False, ncols=4, loc="upper left")
    axes[0].set_ylim(0, 1.35 * axes[0].get_ylim()[1])
    inset = axes[0].inset_axes((0.05, 0.48, 0.30, 0.34))
    for bands, style in (("simple", "-"), ("exhaustive", "--")):
        rows = study.run(Case(*at, "pbi", 30, bands=bands))
        inset.plot(rows.frame[1:], rows["lighting_error"][1:], style, lw=1, label=bands)
    inset.legend(fontsize=6, frameon=False, loc="upper left")
    inset.tick_params(labelsize=6)
    inset.set_title("PBI-30, choice of bands", fontsize=7, pad=2)
    figure.suptitle(f"{at[0]} under {at[1]}, {at[2]}; light rests from frame {STOP} on")
    figure.savefig(file)
    plt.close(figure)


def draw_estimates(study, table, file):
    """Error over time with its estimate and bound; estimate against error in all runs."""
    plt = pyplot()
    at = study.front()
    figure, axes = plt.subplots(1, 2, figsize=(13, 5), constrained_layout=True)
    rows = study.run(Case(*at, "pbi", 30))
    for column, label, style in (("image_rel_rmse", "error", "k-"), ("error_estimate", "estimate", "C2-"),
                                 ("error_bound", "bound", "C3-")):
        axes[0].plot(rows.frame[1:], np.maximum(rows[column][1:], 1e-8), style, lw=1.3, label=label)
    axes[0].axhline(np.nanmedian(rows["transport_error"]), color="0.5", ls=":",
                    label="transport (its file)")
    axes[0].set_yscale("log")
    axes[0].set_xlabel("frame")
    axes[0].set_ylabel("picture error, relative")
    axes[0].set_title(f"PBI-30: {at[0]} under {at[1]}, {at[2]}")
    axes[0].legend(frameon=False)
    error, estimate, bound = [], [], []
    for case in study.cases():
        if case.method.startswith("sh") or case.method == "reference":
            continue
        r = study.run(case)
        keep = (r["image_rel_rmse"] > 1e-6)
        error += list(r["image_rel_rmse"][keep])
        estimate += list(r["error_estimate"][keep])
        bound += list(r["error_bound"][keep])
    error = np.array(error)
    axes[1].plot(error, bound, ".", ms=1.5, color="C3", alpha=0.3, label="bound")
    axes[1].plot(error, estimate, ".", ms=1.5, color="C2", alpha=0.3, label="estimate")
    ends = np.array([error.min(), error.max()])
    for factor, style in ((1, "k-"), (NEAR, "k:"), (1 / NEAR, "k:")):
        axes[1].plot(ends, factor * ends, style, lw=0.8)
    ratio = np.array(estimate) / error
    near = np.mean((ratio < NEAR) & (ratio > 1 / NEAR))
    axes[1].set_title(f"{len(error)} frames: {100 * near:.1f} % of estimates within {NEAR} times; "
                      f"bound broken in {int(np.sum(np.array(bound) < error))}")
    axes[1].set_xscale("log")
    axes[1].set_yscale("log")
    axes[1].set_xlabel("error")
    axes[1].legend(frameon=False, markerscale=5)
    figure.savefig(file)
    plt.close(figure)


def study_rows(study, name, *arguments):
    path = study.runs / f"{name}.csv"
    if not path.exists():
        study.program("haarlight-study", *arguments, "-o", path)
        study.note(name)
    with open(path, newline="") as f:
        return list(csv.DictReader(f)), path


def draw_chosen(study, file):
    """Overbeck 2006, Figure 4: coverage of the light by chosen wavelets, and which bands they are of."""
    plt = pyplot()
    env = study.front()[1]
    frames = (30, 75, 125)
    figure, axes = plt.subplots(3, 3, figsize=(12, 6.5), constrained_layout=True,
                                gridspec_kw={"height_ratios": (1, 1, 2.4)})
    order = (1, 4, 0, 5)  # faces round the horizon: -X +Z +X -Z, in one row
    for column, frame in enumerate(frames):
        bars = {}
        for row, method in enumerate(("nwa", "bi")):
            rows, path = study_rows(study, f"chosen_{env}_{method}", "chosen", "--env",
                                    study.environment(env), "--method", method, "--wavelets", 30,
                                    "--frames", FRAMES, "--map-frames", ",".join(map(str, frames)))
            maps = np.zeros((6, 64, 64))
            with open(str(path) + ".map.csv", newline="") as f:
                for r in csv.DictReader(f):
                    if int(r["frame"]) == frame:
                        maps[int(r["face"]), int(r["y"]), int(r["x"])] = int(r["count"])
            axis = axes[row][column]
            axis.imshow(np.concatenate([maps[i] for i in order], axis=1), cmap="Greys", vmin=0, vmax=6,
                        interpolation="nearest")
            axis.set_xticks([])
            axis.set_yticks([])
            axis.grid(False)
            axis.set_title(f"{method.upper()}-30, frame {frame}: wavelets over a texel", fontsize=9)
        for method in ("nwa", "bi", "pbi"):
            rows, _ = study_rows(study, f"chosen_{env}_{method}", "chosen", "--env",
                                 study.environment(env), "--method", method, "--wavelets", 30,
                                 "--frames", FRAMES, "--map-frames", ",".join(map(str, frames)))
            count = np.zeros(6)
            for r in rows:
                if frame - 2 <= int(r["frame"]) <= frame + 2:
                    count[int(r["band"])] += int(r["chosen"]) / 5
            bars[method] = count
        for i, (method, count) in enumerate(bars.items()):
            axes[2][column].bar(np.arange(6) + 0.27 * (i - 1), count, 0.27, label=method.upper(),
                                color=COLOURS[method])
        axes[2][column].set_xticks(range(6), [4096 >> (2 * b) for b in range(6)])
        axes[2][column].set_xlabel("area of wavelets, texels")
        axes[2][column].set_ylabel("chosen a frame, mean of 5 frames")
    axes[2][0].legend(frameon=False)
    figure.suptitle(f"{env}, rotate")
    figure.savefig(file)
    plt.close(figure)


def draw_energy(study, file):
    """Overbeck 2006, Figure 5: energy of the light by spatial and temporal band."""
    plt = pyplot()
    env = study.front()[1]
    rows, _ = study_rows(study, f"energy_{env}", "energy", "--env", study.environment(env),
                         "--frames", 128, "--stop", 127)
    energy = np.zeros((8, 6))
    for r in rows:
        energy[int(r["temporal"]), int(r["band"])] = float(r["energy"])
    share = energy / energy.sum(axis=0)
    figure, axis = plt.subplots(figsize=(6, 5), constrained_layout=True)
    drawn = axis.imshow(share, cmap="Greys", aspect="auto", vmin=0, vmax=share.max())
    for t in range(8):
        for b in range(6):
            axis.text(b, t, f"{100 * share[t, b]:.0f}", ha="center", va="center", fontsize=8,
                      color="w" if share[t, b] > 0.5 * share.max() else "k")
    axis.set_xticks(range(6), [4096 >> (2 * b) for b in range(6)])
    axis.set_yticks(range(8), ["mean"] + [str(128 >> t) for t in range(7)])
    axis.set_xlabel("spatial band: area of wavelets, texels")
    axis.set_ylabel("temporal band: frames")
    axis.grid(False)
    axis.set_title(f"{env}, rotate, 128 frames: % of a spatial band's energy")
    figure.colorbar(drawn)
    figure.savefig(file)
    plt.close(figure)


def draw_resets(study, file):
    """Overbeck 2006, Figure 9: a bar where a band was reset."""
    plt = pyplot()
    rows = study.run(Case(*study.front(), "pbi", 30))
    resets = rows.resets()
    figure, axes = plt.subplots(len(resets), 1, figsize=(9, 5), sharex=True, constrained_layout=True)
    for b, axis in enumerate(axes):
        axis.axhline(0, color="C2", lw=1)
        axis.vlines(rows.frame[1:][resets[b][1:] == 1], 0, 1, color="k", lw=1)
        axis.set_yticks([])
        axis.grid(False)
        axis.set_ylabel(str(4096 >> (2 * b)), rotation=0, ha="right", va="center")
        axis.axvline(STOP, color="0.5", lw=1, ls="--")
    axes[0].set_title("PBI-30: incremental (line) or reset (bar), by area of wavelets", fontsize=9)
    axes[-1].set_xlabel("frame")
    axes[-1].set_xlim(0, rows.frame[-1])
    figure.savefig(file)
    plt.close(figure)


def draw_strip(study, file, title, columns, frames):
    """Pictures beside each other: columns of (label, case), a row a frame, with a close-up each."""
    plt = pyplot()
    pictures = [75, 104]
    figure, axes = plt.subplots(2 * len(frames), len(columns), squeeze=False,
                                figsize=(2.6 * len(columns), 5.4 * len(frames)), constrained_layout=True)
    for c, (label, case) in enumerate(columns):
        rows = study.run(case, pictures=pictures)
        for r, frame in enumerate(frames):
            image = plt.imread(study.out / "frames" / case.key / f"frame_{frame:04}.png")[..., :3]
            h, w = image.shape[:2]
            part = image[int(0.45 * h):int(0.85 * h), int(0.08 * w):int(0.48 * w)]
            for axis, shown in ((axes[2 * r][c], image), (axes[2 * r + 1][c], part)):
                axis.imshow(shown, interpolation="nearest")
                axis.set_xticks([])
                axis.set_yticks([])
                axis.grid(False)
                axis.spines[:].set_visible(False)
            error = rows["image_rel_rmse"][frame]
            text = f"{label}, frame {frame}"
            if np.isfinite(error):
                text += f"\nerror {100 * error:.2f} %"
            axes[2 * r][c].set_title(text, fontsize=8)
    figure.suptitle(title, fontsize=10)
    figure.savefig(file)
    plt.close(figure)


def strips(study, table):
    at = study.front()
    exact = ("exact", Case(*at, "reference"))

    def column(method, k, **more):
        label = f"{method.upper()}-{k}" + (" transport" if more else "")
        return label, Case(*at, method, k, **more)

    draw_strip(study, study.out / "strip_equal_wavelets.png",
               "Equal number of wavelets (Overbeck 2006, Figures 1 and 8)",
               [column("nwa", 30), column("bi", 30), column("pbi", 30), exact], (75, 104))
    draw_strip(study, study.out / "strip_equal_quality.png",
               "Equal quality (Overbeck 2006, Figure 10)",
               [column("pbi", 30), column("nwa", 100), column("pbi", 100), column("nwa", 300), exact],
               (75, 104))

    # Equal time: the case of each method whose median is nearest to PBI-30's.
    rows = [r for r in table if (r["scene"], r["env"], r["motion"]) == at]
    wanted = next(r["ms"] for r in rows if r["family"] == "pbi" and r["budget"] == "30")
    columns = []
    for family in ("sh5", "nwa", "bi", "pbi", "pbi transport"):
        of = [r for r in rows if r["family"] == family]
        if not of:
            continue
        best = min(of, key=lambda r: abs(np.log(r["ms"] / wanted)))
        sh = family.startswith("sh")
        case = Case(*at, best["method"], None if sh else int(best["budget"]), weight=best["weight"])
        if not sh:  # the study of spherical harmonics writes no PNG
            method, _, weight = family.partition(" ")
            label = f"{method.upper()}-{best['budget']} {weight}".strip()
            columns.append((f"{label}: {best['ms']:.2f} ms", case))
    draw_strip(study, study.out / "strip_equal_time.png", "Nearly equal time a frame",
               columns + [exact], (75, 104))


def text_table(table):
    columns = ("scene", "env", "motion", "family", "budget", "wavelets", "ms", "error", "error_p90",
               "error_104", "error_124", "flicker", "lighting_error", "near", "judged", "bound_over_error")
    yield "<table><tr>" + "".join(f"<th>{c}</th>" for c in columns) + "</tr>"
    for row in table:
        cells = (f"{row[c]:.4g}" if isinstance(row[c], float) else html.escape(str(row[c]))
                 for c in columns)
        yield "<tr>" + "".join(f"<td>{c}</td>" for c in cells) + "</tr>"
    yield "</table>"


def write_page(study, table, figures):
    lines = ["<!doctype html><meta charset=utf-8><title>What accuracy costs in time</title>",
             "<style>body{font:14px sans-serif;max-width:1300px;margin:2em auto}img{max-width:100%}"
             "table{border-collapse:collapse;font-size:11px}td,th{padding:1px 6px;text-align:right}"
             "</style><h1>What accuracy costs in time</h1>"]
    for file in figures:
        data = base64.b64encode(Path(file).read_bytes()).decode()
        lines.append(f"<h2>{html.escape(Path(file).stem.replace('_', ' '))}</h2>"
                     f'<img src="data:image/png;base64,{data}">')
    judged, near = sum(r["judged"] for r in table), sum(r["near"] for r in table)
    broken = sum(r["bound_broken"] for r in table)
    lines.append(f"<p>Estimates within {NEAR} times the error: {near} of {judged} moving frames; bound "
                 f"below the error in {broken} frames.</p>")
    lines += text_table(table)
    temporary = study.out / "curves.html.tmp"
    temporary.write_text("\n".join(lines))
    os.replace(temporary, study.out / "curves.html")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("data")
    parser.add_argument("out")
    parser.add_argument("--bin", default="build/bin")
    parser.add_argument("--size", type=int, help="pixels along a picture [quick: 128, else 256]")
    parser.add_argument("--cpca", metavar="DIR",
                        help="what bench/cpca.py left: its pictures become part of the page")
    kind = parser.add_mutually_exclusive_group()
    kind.add_argument("--quick", action="store_true", help="one scene, one light (the default)")
    kind.add_argument("--full", action="store_true", help="all scenes, lights and motions")
    args = parser.parse_args()
    args.quick = not args.full
    args.size = args.size or (128 if args.quick else 256)
    study = Study(args)
    table = study.measure()
    figures = []

    def figure(name, draw, *arguments):
        file = study.out / name
        draw(*arguments, file)
        study.note(f"drew {file}")
        figures.append(file)

    places = sorted({(r["scene"], r["env"], r["motion"]) for r in table})
    for at in places:
        figure(f"front_{'_'.join(at)}.png", draw_fronts, table, at)
    figure("error_over_time.png", draw_over_time, study)
    figure("estimates.png", draw_estimates, study, table)
    figure("chosen.png", draw_chosen, study)
    figure("energy.png", draw_energy, study)
    figure("resets.png", draw_resets, study)
    strips(study, table)
    figures += [study.out / f"strip_equal_{what}.png" for what in ("wavelets", "quality", "time")]
    if args.cpca:
        figures += sorted(Path(args.cpca).glob("*.png"))
    write_page(study, table, figures)
    study.note(f"wrote {study.out / 'curves.html'}, {study.out / 'summary.csv'}")


if __name__ == "__main__":
    main()
