#!/usr/bin/env python3
"""How near error_estimate is to image_rel_rmse, and whether error_bound holds, as a Markdown table.

  bench/estimates.py OUT_DIR FILE.hlt... --env A.exr --env-to B.exr [--size 256x256] [--orbit DEGREES]
                     [--motions rotate,blend] [--bin build/bin]

Every file is relit under `rotate` of A and `blend` from A to B, by NWA and PBI at 10, 30 and 100
wavelets, 50 frames of which the last 15 rest; with --orbit the camera goes round, too. An estimate is near within a factor of 1.5; errors
below 1e-6, which are rounding, are left out.
"""
import argparse
import csv
import math
import os
import subprocess


def sequence(args, transport, motion, method, wavelets, path):
    command = [os.path.join(args.bin, "haarlight"), "relight", transport, "--env", args.env,
               "--motion", motion, "--method", method, "--wavelets", str(wavelets), "--frames", "50",
               "--stop", "35", "--against-reference", "--metrics", path]
    if motion == "blend":
        command += ["--env-to", args.env_to]
    if args.size:
        command += ["--size", args.size]
    if args.orbit:
        command += ["--orbit", str(args.orbit)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(path) as f:
        return list(csv.DictReader(f))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("files", nargs="+")
    parser.add_argument("--env", required=True)
    parser.add_argument("--env-to", required=True)
    parser.add_argument("--size")
    parser.add_argument("--orbit", type=float)
    parser.add_argument("--motions", default="rotate,blend")
    parser.add_argument("--bin", default="build/bin")
    args = parser.parse_args()
    os.makedirs(args.out, exist_ok=True)
    print("| file | motion | frames | near | estimate / error, 5 %, median, 95 % | bound broken |"
          " bound finite | bound / error, median |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for transport in args.files:
        name = os.path.splitext(os.path.basename(transport))[0]
        for motion in args.motions.split(","):
            ratios, bounds, broken, frames = [], [], 0, 0
            for method in ("nwa", "pbi"):
                for wavelets in (10, 30, 100):
                    path = os.path.join(args.out, f"{name}-{motion}-{method}-{wavelets}.csv")
                    for row in sequence(args, transport, motion, method, wavelets, path):
                        error, estimate, bound = (float(row[c]) for c in (
                            "image_rel_rmse", "error_estimate", "error_bound"))
                        frames += 1
                        broken += not bound >= error
                        if error > 1e-6:
                            ratios.append(estimate / error)
                            bounds.append(bound / error)
            ratios.sort()
            bounds.sort()
            near = sum(1 / 1.5 < r < 1.5 for r in ratios) / len(ratios)
            at = [ratios[int(q * (len(ratios) - 1))] for q in (0.05, 0.5, 0.95)]
            finite = [b for b in bounds if math.isfinite(b)]
            middle = f"{finite[len(finite) // 2]:.0f}" if finite else "-"
            print(f"| {name} | {motion} | {len(ratios)} | {100 * near:.1f} % |"
                  f" {at[0]:.2f}, {at[1]:.2f}, {at[2]:.2f} | {broken} of {frames} |"
                  f" {100 * len(finite) / len(bounds):.0f} % | {middle} |", flush=True)


if __name__ == "__main__":
    main()
