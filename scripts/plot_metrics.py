#!/usr/bin/env python3
"""Draws error over time from metrics files of `haarlight relight`, and prints a table.

The plot is that of Overbeck et al. 2006, Figure 7 (error over time while the light turns faster and
faster, then rests), with the bands that were reset drawn below as in its Figure 9.

    plot_metrics.py nwa.csv bi.csv pbi.csv --stop 99 -o error_over_time.png

Needs numpy and matplotlib (Debian: python3-numpy, python3-matplotlib).
"""

import argparse
import csv
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

COLUMNS = (
    "frame,method,wavelets,weight,updates,resets,lighting_error,image_rel_rmse,image_max_abs,"
    "update_ms,apply_ms,finish_ms,total_ms,bytes,flicker,error_estimate,error_bound,transport_error"
).split(",")


class Failure(Exception):
    """A message for the user, one line."""


class Run:
    """The rows of one method, by frame."""

    def __init__(self, file, method, wavelets, weight, rows):
        self.file, self.method, self.wavelets, self.weight = file, method, wavelets, weight
        rows = sorted(rows, key=lambda row: int(row["frame"]))
        number = lambda text: float(text) if text else np.nan
        self.frame = np.array([int(row["frame"]) for row in rows])
        self.lighting = np.array([number(row["lighting_error"]) for row in rows])
        self.picture = np.array([number(row["image_rel_rmse"]) for row in rows])
        self.total_ms = np.array([number(row["total_ms"]) for row in rows])
        self.mebibytes = np.array([number(row["bytes"]) for row in rows]) / 2**20
        # One row a band, coarsest first; one column a frame.
        self.resets = np.array([[int(digit) for digit in row["resets"]] for row in rows]).T
        self.label = ""

    def has_picture(self):
        return np.isfinite(self.picture).any()

    def at(self, frame):
        """Lighting error of a frame; nan when the run is shorter."""
        found = np.flatnonzero(self.frame == frame)
        return self.lighting[found[0]] if len(found) else np.nan


def read_runs(files):
    runs = []
    for file in files:
        try:
            with open(file, newline="") as stream:
                reader = csv.DictReader(stream)
                if reader.fieldnames != COLUMNS:
                    raise Failure(f"{file}: is no metrics file, expected the columns {','.join(COLUMNS)}")
                rows = list(reader)
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise Failure(f"{file}: {error}") from error
        groups = {}
        for row in rows:
            groups.setdefault((row["method"], row["wavelets"], row["weight"]), []).append(row)
        for (method, wavelets, weight), members in groups.items():
            frames = [row["frame"] for row in members]
            if len(set(frames)) != len(frames):
                raise Failure(f"{file}: {method} has a frame twice, expected each once")
            try:
                runs.append(Run(Path(file), method, int(wavelets), weight, members))
            except (TypeError, ValueError) as error:
                raise Failure(f"{file}: {error}") from error
    if not runs:
        raise Failure("no rows in the files, expected at least one frame")
    name_runs(runs)
    return runs


def name_runs(runs):
    """Method and budget; where that is not enough to tell runs apart, weight, then file."""
    for run in runs:
        exact = run.method == "reference"
        run.label = run.method if exact else f"{run.method.upper()}-{run.wavelets}"
    for more in (lambda run: run.weight, lambda run: f"({run.file})"):
        labels = [run.label for run in runs]
        for run in runs:
            if labels.count(run.label) > 1:
                run.label += " " + more(run)


def mean_or_nan(values):
    values = values[np.isfinite(values)]
    return values.mean() if len(values) else np.nan


def table(runs, stop):
    """Lines of text: one a run, errors as in the metrics file, milliseconds as medians."""
    heads = [
        "method",
        f"lighting error, mean of frames 1-{stop}",
        f"at frame {stop + 5}",
        f"at frame {stop + 25}",
        "picture error, mean",
        "ms a frame",
        "MiB a frame",
    ]
    rows = []
    for run in runs:
        moving = (run.frame >= 1) & (run.frame <= stop)
        later = run.frame >= 1
        cells = [
            mean_or_nan(run.lighting[moving]),
            run.at(stop + 5),
            run.at(stop + 25),
            mean_or_nan(run.picture[later]),
        ]
        text = [run.label] + ["-" if np.isnan(cell) else f"{cell:.4f}" for cell in cells]
        for values, form in ((run.total_ms, "{:.2f}"), (run.mebibytes, "{:.1f}")):
            text.append(form.format(np.median(values[later])) if later.any() else "-")
        rows.append(text)
    widths = [max(len(row[i]) for row in [heads] + rows) for i in range(len(heads))]
    lines = []
    for row in [heads] + rows:
        first = row[0].ljust(widths[0])
        lines.append("  ".join([first] + [cell.rjust(w) for cell, w in zip(row[1:], widths[1:])]))
    lines.insert(1, "-" * len(lines[0]))
    return lines


def write_atomically(file, write):
    """write(path) makes a temporary beside `file`, which then takes its name."""
    file = Path(file)
    handle, temporary = tempfile.mkstemp(dir=file.parent, prefix=".", suffix=file.suffix)
    os.close(handle)
    try:
        write(temporary)
        os.chmod(temporary, 0o644)
        os.replace(temporary, file)
    except BaseException:
        os.unlink(temporary)
        raise


def plot(runs, stop, title, file):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    shown = [run for run in runs if run.method != "reference"] or runs
    with_picture = any(run.has_picture() for run in shown)
    with_resets = [run for run in shown if run.method == "pbi" and run.resets.size]

    # Panels from top to bottom: lighting error, picture error, the bands reset by each PBI run.
    heights = [3.0] + ([2.2] if with_picture else []) + [0.9] * len(with_resets)
    figure, axes = plt.subplots(
        len(heights), 1, sharex=True, squeeze=False, constrained_layout=True,
        figsize=(9, 1.0 + sum(heights)), dpi=120, gridspec_kw={"height_ratios": heights})
    axes = list(axes[:, 0])
    colours = {run.label: f"C{i % 10}" for i, run in enumerate(shown)}

    error_axes = axes[: 1 + with_picture]
    for axis, values_of, name in zip(
        error_axes,
        (lambda run: run.lighting, lambda run: run.picture),
        ("lighting error\n(area-weighted L1, relative)", "picture error\n(relative RMSE)"),
    ):
        for run in shown:
            axis.plot(run.frame, values_of(run), color=colours[run.label], label=run.label, lw=1.6)
        axis.set_ylabel(name)
        axis.set_ylim(0, 1.3 * max(axis.dataLim.ymax, 1e-6))  # room for the legend
        axis.grid(alpha=0.25)
        axis.axvline(stop, color="0.5", lw=1, ls="--")
    long_names = max(len(run.label) for run in shown) > 16
    error_axes[0].legend(loc="upper left", ncols=min(2 if long_names else 4, len(shown)),
                         frameon=False, fontsize=8 if long_names else 10)
    error_axes[0].annotate("light rests", (stop, 1), (0, 3), xycoords=("data", "axes fraction"),
                           textcoords="offset points", ha="center", va="bottom", color="0.4",
                           fontsize=9)
    if title:
        error_axes[0].set_title(title)

    for axis, run in zip(axes[len(error_axes):], with_resets):
        bands = len(run.resets)
        axis.imshow(run.resets, aspect="auto", cmap="Greys", vmin=0, vmax=1.4, interpolation="nearest",
                    extent=(run.frame[0] - 0.5, run.frame[-1] + 0.5, bands - 0.5, -0.5))
        axis.set_yticks(range(bands))
        axis.tick_params(axis="y", labelsize=6, length=0)
        axis.set_ylabel("bands", fontsize=8)
        axis.set_title(f"{run.label}: bands reset, coarsest first", loc="left", fontsize=8, pad=3)
    axes[-1].set_xlabel("frame")
    write_atomically(file, figure.savefig)


def merge(files, merged):
    """All rows of all files below one header."""
    lines = [",".join(COLUMNS)]
    for file in files:
        lines += Path(file).read_text().splitlines()[1:]
    write_atomically(merged, lambda path: Path(path).write_text("\n".join(lines) + "\n"))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("csv", nargs="+", help="metrics files; one may hold several methods")
    parser.add_argument("-o", "--output", metavar="FILE.png", help="the plot; none without it")
    parser.add_argument("--stop", type=int, default=99, metavar="F",
                        help="frame at which the light came to rest [99]")
    parser.add_argument("--title", default="", help="line above the plot")
    parser.add_argument("--merged", metavar="FILE.csv", help="also write all rows to one metrics file")
    arguments = parser.parse_args()
    try:
        runs = read_runs(arguments.csv)
        if arguments.merged:
            merge(arguments.csv, arguments.merged)
        if arguments.output:
            plot(runs, arguments.stop, arguments.title, arguments.output)
    except (Failure, OSError) as error:
        print(f"plot_metrics.py: {error}", file=sys.stderr)
        return 1
    print("\n".join(table(runs, arguments.stop)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
