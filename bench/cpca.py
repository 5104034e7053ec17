#!/usr/bin/env python3
"""Measures clustered PCA with the programs themselves: tables as Markdown, CSV, a curve, pictures.

  bench/cpca.py OUT_DIR --env A.exr --env-to B.exr [--transport STREET.hlt] [--bin build/bin]
                [--clusters 398] [--basis 25] [--parts relight,curve,pictures]

Without --transport the street of haarlight-data is made and precomputed, 6x32x32, 4 terms. What
OUT_DIR holds already is kept: cpca.csv (relighting), curve.csv and curve.png (bytes and error
against clusters and vectors), cpca.png (side by side), clusters.png.
"""
import argparse
import csv
import json
import os
import re
import resource
import subprocess
import sys
import time

CURVE_CLUSTERS = (100, 398, 1592)
CURVE_BASIS = (6, 12, 25)
CURVE_ERRORS = (0.1, 0.05, 0.02)
STOP = 99  # frame at which motions rest

# name, method, wavelets, vectors a frame
METHODS = (
    ("PBI-30, S/4", "pbi", 30, "quarter"),
    ("PBI-30, all S", "pbi", 30, "all"),
    ("NWA-30, all S", "nwa", 30, "all"),
    ("NWA-100, all S", "nwa", 100, "all"),
    ("all wavelets, S/4", "reference-light", 0, "quarter"),
    ("all wavelets, all S", "reference", 0, "all"),
)


def run(*command):
    return subprocess.run([str(c) for c in command], check=True, stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, text=True).stdout


def measured(*command):
    """Seconds and peak memory (MiB) of a command."""
    begin = time.monotonic()
    process = subprocess.Popen([str(c) for c in command], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise subprocess.CalledProcessError(status, command)
    return time.monotonic() - begin, usage.ru_maxrss / 1024


def median(values):
    return sorted(values)[len(values) // 2]


def mean(values):
    return sum(values) / len(values)


class Study:
    def __init__(self, args):
        self.args, self.out = args, args.out
        os.makedirs(self.out, exist_ok=True)
        self.haarlight = os.path.join(args.bin, "haarlight")
        self.transport = args.transport or self.street()

    def street(self):
        scene, path = os.path.join(self.out, "street.glb"), os.path.join(self.out, "street.hlt")
        if not os.path.exists(path):
            run(os.path.join(self.args.bin, "haarlight-data"), "scene", "street", "-o", scene)
            run(self.haarlight, "precompute", scene, "--vertices", "--terms", 4, "--face", 32,
                "--effects", "shadows,gloss", "-o", path)
        return path

    def info(self, path):
        return json.loads(run(self.haarlight, "info", path, "--json"))

    def compressed(self, name, *options):
        """Path of a compressed transport, with what it took (kept beside it)."""
        path = os.path.join(self.out, name + ".hlt")
        note = path + ".json"
        if not os.path.exists(note):
            seconds, peak = measured(self.haarlight, "compress", self.transport, "-o", path, *options)
            with open(note, "w") as f:
                json.dump({"seconds": seconds, "peak_mib": peak}, f)
        with open(note) as f:
            took = json.load(f)
        info = self.info(path)
        took.update(bytes=info["file_bytes"], error=info["made"]["measured_error"],
                    clusters=info["made"]["compressed"]["clusters"],
                    vectors=info["made"]["compressed"]["vectors"])
        return path, took

    def main_file(self):
        return self.compressed("main", "--clusters", self.args.clusters, "--basis", self.args.basis)

    def sequence(self, path, motion, method, wavelets, terms, *options):
        metrics = os.path.join(self.out, "metrics.csv")
        command = [self.haarlight, "relight", path, "--env", self.args.env, "--motion", motion,
                   "--metrics", metrics, "--size", self.args.size]
        if motion == "blend":
            command += ["--env-to", self.args.env_to]
        if method == "reference-light":  # as many as there are
            command += ["--method", "bi", "--wavelets", 6 * 1024 * 1024]
        else:
            command += ["--method", method] + (["--wavelets", wavelets] if wavelets else [])
        if terms:
            command += ["--basis-terms", terms]
        run(*command, *options)
        with open(metrics) as f:
            return list(csv.DictReader(f))

    def size_table(self):
        path, took = self.main_file()
        info = self.info(self.transport)
        source = info["file_bytes"]
        dense = info["vertices"] * info["terms"] * info["coefficients"] * 4
        print(f"| {info['vertices']} vertices, {info['terms']} terms, {took['clusters']} clusters, "
              f"{took['vectors'] / took['clusters']:.1f} vectors | |\n| --- | --- |")
        print(f"| transport, dense floats | {dense / 2**20:.0f} MiB |")
        print(f"| transport file | {source / 2**20:.1f} MiB |")
        print(f"| compressed file | {took['bytes'] / 2**20:.1f} MiB |")
        print(f"| times smaller than the file; than dense floats | "
              f"{source / took['bytes']:.1f}; {dense / took['bytes']:.0f} |")
        print(f"| measured error (worst built-in lighting) | {100 * took['error']:.2f} % |")
        print(f"| compressing | {took['seconds']:.0f} s, {took['peak_mib']:.0f} MiB |\n")

    def relight(self):
        path, _ = self.main_file()
        rows = []
        for motion in ("rotate", "blend"):
            for name, method, wavelets, terms in METHODS:
                # Times from a run that relights once a frame, errors from one that does twice.
                timed = self.sequence(path, motion, method, wavelets, terms)
                against = self.sequence(path, motion, method, wavelets, terms, "--against-reference")
                moving = slice(1, STOP)
                ms = {c: median([float(r[c]) for r in timed[moving]])
                      for c in ("update_ms", "apply_ms", "finish_ms", "total_ms")}
                error = mean([float(r["image_rel_rmse"]) for r in against[moving]])
                rests = [i for i, r in enumerate(against) if i > STOP and
                         float(r["image_rel_rmse"]) < 1e-6]
                rows.append({"motion": motion, "method": name, **ms, "updates_per_s": 1000 / ms["total_ms"],
                             "error": error, "exact_from_frame": rests[0] if rests else ""})
        with open(os.path.join(self.out, "cpca.csv"), "w", newline="") as f:
            table = csv.DictWriter(f, rows[0].keys())
            table.writeheader()
            table.writerows(rows)
        for motion in ("rotate", "blend"):
            here = [r for r in rows if r["motion"] == motion]
            exact = here[-1]["total_ms"]
            print(f"| {motion} | decide, ms | steps 1 and 2 | step 3 and drawing | updates/s | "
                  "against exact | picture error | exact from frame |")
            print("| --- |" + " --- |" * 7)
            for r in here:
                print(f"| {r['method']} | {r['update_ms']:.2f} | {r['apply_ms']:.2f} | "
                      f"{r['finish_ms']:.2f} | {r['updates_per_s']:.0f} | "
                      f"{exact / r['total_ms']:.1f}x | {r['error']:.4f} | {r['exact_from_frame']} |")
            by = {r["method"]: r["error"] for r in here}
            print(f"\nS/4 against all S: {by['PBI-30, S/4'] / by['PBI-30, all S']:.3f}; PBI-30, S/4 "
                  f"against NWA-100, all S: {by['PBI-30, S/4'] / by['NWA-100, all S']:.2f}\n")

    def picture(self, path, name, motion, frame, *options):
        folder = os.path.join(self.out, name)
        command = [self.haarlight, "relight", path, "--env", self.args.env, "--motion", motion,
                   "--save-frames", frame, "--frames", frame + 1, "--size", self.args.size, "-o", folder]
        if motion == "blend":
            command += ["--env-to", self.args.env_to]
        if self.exposure is not None:
            command += ["--exposure", self.exposure]
        run(*command, *options)
        return os.path.join(folder, f"frame_{frame:04}")

    exposure = None

    def difference(self, a, b):
        return json.loads(run(self.haarlight, "compare", a + ".exr", b + ".exr", "--json"))["relative_rmse"]

    def curve(self):
        rows = []
        source = os.path.getsize(self.transport)
        exact = self.picture(self.transport, "exact", "still", 0, "--no-background")
        choices = [(f"c{c}s{s}", ("--clusters", c, "--basis", s)) for c in CURVE_CLUSTERS for s in CURVE_BASIS]
        choices += [(f"e{e}", ("--error", e)) for e in CURVE_ERRORS]
        for name, options in choices:
            path, took = self.compressed(name, *options)
            picture = self.picture(path, "curve", "still", 0, "--no-background")
            rows.append({"options": " ".join(map(str, options)), **took, "times_smaller": source / took["bytes"],
                         "picture_error": self.difference(picture, exact)})
        with open(os.path.join(self.out, "curve.csv"), "w", newline="") as f:
            table = csv.DictWriter(f, rows[0].keys())
            table.writeheader()
            table.writerows(rows)
        print("| options | vectors | MiB | times smaller | measured error | picture error | s | peak MiB |")
        print("| --- |" + " --- |" * 7)
        for r in rows:
            print(f"| `{r['options']}` | {r['vectors']} | {r['bytes'] / 2**20:.1f} | {r['times_smaller']:.1f} | "
                  f"{100 * r['error']:.2f} % | {100 * r['picture_error']:.2f} % | {r['seconds']:.0f} | "
                  f"{r['peak_mib']:.0f} |")
        print()
        self.plot(rows)

    def plot(self, rows):
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
        figure, axes = plt.subplots(figsize=(7, 4.2), dpi=110)
        for clusters in CURVE_CLUSTERS:
            here = [r for r in rows if r["options"].startswith(f"--clusters {clusters} ")]
            axes.plot([r["bytes"] / 2**20 for r in here], [100 * r["picture_error"] for r in here], "o-",
                      label=f"{clusters} clusters, S = " + ", ".join(map(str, CURVE_BASIS)))
        here = [r for r in rows if r["options"].startswith("--error")]
        axes.plot([r["bytes"] / 2**20 for r in here], [100 * r["picture_error"] for r in here], "ks--",
                  label="S by --error " + ", ".join(map(str, CURVE_ERRORS)))
        axes.axvline(os.path.getsize(self.transport) / 2**20, color="0.6", lw=1, label="transport file")
        axes.set(xscale="log", yscale="log", xlabel="file, MiB", ylabel="picture error, % (relative RMSE)")
        axes.grid(True, which="both", alpha=0.3)
        axes.legend(fontsize=8)
        figure.tight_layout()
        figure.savefig(os.path.join(self.out, "curve.png"))

    def pictures(self):
        path, _ = self.main_file()
        frame = 75
        columns = []
        for motion in ("rotate", "blend"):
            # One exposure for all, the automatic one of the exact picture.
            self.exposure = self.args.exposure
            made = [("NWA-30", path, ("--method", "nwa", "--wavelets", 30, "--basis-terms", "all")),
                    ("NWA-100", path, ("--method", "nwa", "--wavelets", 100, "--basis-terms", "all")),
                    ("PBI-30, S/4", path, ("--method", "pbi", "--wavelets", 30)),
                    ("exact, clusters", path, ("--method", "reference")),
                    ("exact, uncompressed", self.transport, ("--method", "reference"))]
            here = []
            for name, transport, options in made:
                folder = f"{motion}-{re.sub('[^a-z0-9]', '', name.lower())}"
                here.append((name, self.picture(transport, folder, motion, frame, *options)))
            columns.append((motion, here))
            exact = here[-1][1]
            for name, stem in here[:-1]:
                print(f"{motion}, frame {frame}, {name} against uncompressed: {self.difference(stem, exact):.4f}")
        strip = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../scripts/contact_strip.py")
        for motion, here in columns:
            run(sys.executable, strip, *[f"{n}={s}.png" for n, s in here], "-o",
                os.path.join(self.out, f"cpca_{motion}.png"))
        run(os.path.join(self.args.bin, "haarlight-view"), path, "--env", self.args.env, "--headless",
            "--frames", 1, "--clusters", "--screenshot", os.path.join(self.out, "clusters.png"))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0],
                                     epilog=__doc__.split("\n\n", 1)[1],
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--env", required=True)
    parser.add_argument("--env-to", required=True)
    parser.add_argument("--transport")
    parser.add_argument("--bin", default="build/bin")
    parser.add_argument("--clusters", type=int, default=398)
    parser.add_argument("--basis", type=int, default=25)
    parser.add_argument("--size", default="512x512")
    parser.add_argument("--exposure", type=float)
    parser.add_argument("--parts", default="size,relight,curve,pictures")
    args = parser.parse_args()
    study = Study(args)
    parts = {"size": study.size_table, "relight": study.relight, "curve": study.curve,
             "pictures": study.pictures}
    for part in args.parts.split(","):
        parts[part]()


if __name__ == "__main__":
    main()
