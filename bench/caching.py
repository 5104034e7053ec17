#!/usr/bin/env python3
"""Temporal radiance caching against a new cache every frame and against path tracing, as ratios.

  bench/caching.py OUT_DIR [--bin build/bin] [--parts trc] [--scenes cube-in-box moving-light spheres]
                   [--frames 30] [--first 0] [--size 160x120] [--paths 64] [--check 60] [--images docs/images]

Part trc: for each scene, one run each of irc and of trc with every kind of gradients, all with the
same accuracy, and a path tracer with the same noise in every frame. Writes OUT_DIR/trc.csv, one row a
method: seconds, records, speedup and records against irc; error of reprojection and of standing still,
cost of reprojection as a share of hemispheres; accuracy of records in use; flicker and error against
the paths, over 4 x 4 pixels so that the paths' noise is small. The paths are two halves A and B of
independent random numbers: the mean of (x - A)(x - B) is the squared error of x without theirs, whose
RMS in the mean of both is the column noise. life.csv and life.png: accuracy of
records that all live for 20 frames, on cube-in-box (Gautron and others 2007, Figure 10). Reprojection
is judged once more with 4,000 directions a record, as many as the paper's 64 x 64 (Table 1).
What OUT_DIR holds already is kept; start in an empty folder when the program has changed. With --images
life.png and a strip of frames are copied there as caching_life.png and caching_strip.png.
Needs numpy and matplotlib (Debian: python3-numpy, python3-matplotlib).
"""
import argparse
import csv
import shutil
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np

GRADIENTS = ["none", "extrapolated", "interpolated"]
LIFESPAN = {"spheres": 5}  # frames, as in the paper's section 6; else 20
BLOCK = 4


class Failure(Exception):
    """A message for the user, one line."""


def run(*command):
    print("+", " ".join(str(c) for c in command), flush=True)
    done = subprocess.run([str(c) for c in command], stderr=subprocess.DEVNULL)
    if done.returncode != 0:
        raise Failure(f"{command[0]} ended with {done.returncode}")


def rows_of(file):
    with open(file, newline="") as stream:
        return list(csv.DictReader(stream))


def read_exr(file):
    """Three float channels of a scanline file in ZIP blocks, as haarlight writes them."""
    data = file.read_bytes()
    at, box, channels = 8, None, []
    while data[at]:
        name, at = data[at:data.index(0, at)], data.index(0, at) + 1
        at = data.index(0, at) + 1
        size = struct.unpack_from("<i", data, at)[0]
        value, at = data[at + 4:at + 4 + size], at + 4 + size
        if name == b"dataWindow":
            box = struct.unpack("<4i", value)
        elif name == b"compression" and value[0] != 3:
            raise Failure(f"{file}: compression {value[0]}, wanted ZIP")
        elif name == b"channels":
            place = 0
            while value[place]:
                end = value.index(0, place)
                channels.append(value[place:end])
                if struct.unpack_from("<i", value, end + 1)[0] != 2:
                    raise Failure(f"{file}: a channel that is not float")
                place = end + 17
    at += 1
    width, height = box[2] - box[0] + 1, box[3] - box[1] + 1
    out = np.empty((height, len(channels), width), np.float32)
    for block in range(-(-height // 16)):
        begin = struct.unpack_from("<q", data, at + 8 * block)[0]
        y, size = struct.unpack_from("<ii", data, begin)
        lines = min(16, height - (y - box[1]))
        packed, whole = data[begin + 8:begin + 8 + size], 4 * lines * len(channels) * width
        if size < whole:
            raw = np.frombuffer(zlib.decompress(packed), np.uint8).astype(np.int64)
            raw = np.cumsum(np.concatenate([raw[:1], raw[1:] - 128])) % 256
            half = (whole + 1) // 2
            packed = np.empty(whole, np.uint8)
            packed[0::2], packed[1::2] = raw[:half], raw[half:]
            packed = packed.tobytes()
        out[y - box[1]:y - box[1] + lines] = np.frombuffer(packed, "<f4").reshape(lines, len(channels), width)
    order = [channels.index(c) for c in (b"R", b"G", b"B")]
    return out.transpose(0, 2, 1)[:, :, order].astype(np.float64)


def blocks(folder, first, count):
    """Frames x rows x columns x 3, means over blocks of pixels."""
    frames = []
    for f in range(first, first + count):
        x = read_exr(folder / f"frame_{f:04}.exr")
        h, w = x.shape[0] // BLOCK * BLOCK, x.shape[1] // BLOCK * BLOCK
        frames.append(x[:h, :w].reshape(h // BLOCK, BLOCK, w // BLOCK, BLOCK, 3).mean(axis=(1, 3)))
    return np.array(frames)


class Sequences:
    def __init__(self, options):
        self.out, self.options = options.out, options

    def program(self, name):
        return self.options.bin / name

    def scene(self, name):
        file = self.out / f"{name}.glb"
        if not file.exists():
            run(self.program("haarlight-data"), "animation", name, "-o", file)
        return file

    def animate(self, scene, name, *arguments):
        """Folder of frames and rows of metrics; made if it is not there."""
        folder = self.out / f"{scene}-{name}"
        metrics = folder / "metrics.csv"
        if not metrics.exists():
            run(self.program("haarlight"), "animate", self.scene(scene), *arguments, "--frames",
                self.options.frames, "--first", self.options.first, "--size", self.options.size, "-o", folder, "--metrics", metrics)
        return folder, rows_of(metrics)


def mean(rows, column):
    return float(np.mean([float(r[column]) for r in rows]))


def trc(sequences, options):
    table = []
    for scene in options.scenes:
        common = ["--max-lifespan", LIFESPAN.get(scene, 20), "--check", options.check, "--show-life"]
        methods = [("irc", ["--method", "irc", "--check", options.check])]
        methods += [(f"trc-{g}", ["--method", "trc", "--gradients", g, *common]) for g in GRADIENTS]
        halves = [blocks(sequences.animate(scene, f"path-{seed}", "--method", "path", "--filter", "none", "--noise",
                                           "frozen", "--spp", options.paths, "--seed", seed)[0],
                         options.first, options.frames) for seed in (1, 2)]
        size = np.sqrt(np.mean(halves[0] * halves[1]))
        noise = np.sqrt(np.mean((halves[0] - halves[1])**2)) / 2

        def distance(x, of):
            """RMS of x less the truth, of(...) both, as a share of the picture."""
            square = np.mean((of(x) - of(halves[0])) * (of(x) - of(halves[1])))
            return 100 * np.sqrt(max(square, 0)) / size

        base = None
        for name, arguments in methods:
            folder, rows = sequences.animate(scene, name, *arguments)
            found = blocks(folder, options.first, options.frames)
            seconds = sum(float(r[c]) for r in rows for c in ("build_ms", "update_ms", "render_ms")) / 1e3
            records = sum(float(r[c]) for r in rows for c in ("records_new", "records_replaced"))
            base = base or (seconds, records)
            hemispheres = sum(float(r["hemisphere_ms"]) for r in rows)
            table.append({
                "scene": scene, "method": name, "seconds": f"{seconds:.1f}", "records": f"{records:.0f}",
                "speedup": f"{base[0] / seconds:.2f}", "fewer_records": f"{base[1] / records:.2f}",
                "reprojection_error": f"{100 * mean(rows, 'reprojection_error'):.2f}",
                "still_error": f"{100 * mean(rows, 'still_error'):.2f}",
                "reprojection_cost": f"{100 * sum(float(r['reproject_ms']) for r in rows) / hemispheres:.1f}",
                "accuracy": f"{100 * mean(rows, 'accuracy'):.2f}",
                "least_accuracy": f"{100 * min(float(r['accuracy']) for r in rows):.2f}",
                "flicker": f"{distance(found, lambda x: np.diff(x, axis=0)):.3f}",
                "rms_error": f"{distance(found, lambda x: x):.2f}", "noise": f"{100 * noise / size:.2f}"})
    write(sequences.out / "trc.csv", table)
    print(markdown(table))
    if "cube-in-box" in options.scenes:
        reprojection(sequences, options)
        life(sequences, options)
    if options.images:
        strip(sequences, options)


def reprojection(sequences, options):
    """Table 1: error of the light of the next frame."""
    folder = sequences.out / "reprojection.csv"
    if not folder.exists():
        run(sequences.program("haarlight"), "animate", sequences.scene("cube-in-box"), "--method", "trc", "--gradients",
            "none", "--hemisphere-samples", 4000, "--check", options.check, "--frames", 6, "--size", "96x72",
            "--metrics", folder)
    rows = rows_of(folder)
    cost = sum(float(r["reproject_ms"]) for r in rows) / sum(float(r["hemisphere_ms"]) for r in rows)
    print(f"4,000 directions: reprojection is off by {100 * mean(rows, 'reprojection_error'):.2f} %, standing still by "
          f"{100 * mean(rows, 'still_error'):.2f} %; it costs {100 * cost:.1f} % of sampling")


def life(sequences, options):
    """Figure 10: every record lives for 20 frames."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7.2, 4), dpi=100)
    table = []
    for g in GRADIENTS:
        _, rows = sequences.animate("cube-in-box", f"life-{g}", "--method", "trc", "--gradients", g, "--max-lifespan",
                                    20, "--temporal-accuracy", 100, "--check", options.check)
        accuracy = [100 * float(r["accuracy"]) for r in rows]
        axes.plot(accuracy, label=g, marker=".")
        table += [{"gradients": g, "frame": f, "accuracy": f"{a:.3f}"} for f, a in enumerate(accuracy)]
        print(f"records of 20 frames, gradients {g}: accuracy {min(accuracy):.2f} % at least")
    axes.set_xlabel("frame"), axes.set_ylabel("accuracy of records in use, %"), axes.legend()
    axes.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(sequences.out / "life.png")
    write(sequences.out / "life.csv", table)
    if options.images:
        shutil.copy(sequences.out / "life.png", options.images / "caching_life.png")


def strip(sequences, options):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    last = options.first + min(options.frames - 1, 25)
    columns = [("path-1", "frame", "path tracing"), ("irc", "frame", "irradiance caching"),
               ("trc-interpolated", "frame", "temporal"), ("trc-interpolated", "life", "life of its records")]
    figure, axes = plt.subplots(len(options.scenes), 4, figsize=(12, 2.4 * len(options.scenes)), dpi=80,
                                squeeze=False)
    for i, scene in enumerate(options.scenes):
        for j, (name, kind, title) in enumerate(columns):
            axes[i][j].imshow(plt.imread(sequences.out / f"{scene}-{name}" / f"{kind}_{last:04}.png"))
            axes[i][j].set_title(f"{scene}: {title}", fontsize=8), axes[i][j].axis("off")
    figure.tight_layout()
    figure.savefig(options.images / "caching_strip.png")


def write(file, table):
    with open(file, "w", newline="") as stream:
        writer = csv.DictWriter(stream, table[0].keys())
        writer.writeheader()
        writer.writerows(table)


def markdown(table):
    lines = ["| " + " | ".join(table[0]) + " |", "|" + " --- |" * len(table[0])]
    return "\n".join(lines + ["| " + " | ".join(row.values()) + " |" for row in table])


PARTS = {"trc": trc}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--bin", type=Path, default=Path("build/bin"))
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    parser.add_argument("--scenes", nargs="+", default=["cube-in-box", "moving-light", "spheres"])
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--size", default="160x120")
    parser.add_argument("--paths", type=int, default=64)
    parser.add_argument("--check", type=int, default=60)
    parser.add_argument("--images", type=Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    try:
        for part in options.parts:
            PARTS[part](Sequences(options), options)
    except (Failure, OSError) as problem:
        print(f"caching.py: {problem}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
