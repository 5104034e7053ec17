#!/usr/bin/env python3
"""How well `--budget-ms T` is kept: frames within 1.1 T, time spent, and why frames are late.

  bench/budgets.py OUT_DIR FILE.hlt --env A.exr [--ms 4,8] [--bin build/bin]

1,000 frames of `rotate` by 360 degrees (`haarlight-study budget`). *Held up from outside* are late frames
in which threads that could have run waited for a core for at least as long as the frame is over 1.1 T,
or whose work, done again bit for bit in three more runs, was within 1.1 T in most of them; the others
are late by themselves. *Spinning threads* is the share of frames of length T in which one of as many
threads that do nothing but spin (`haarlight-bench`, case machine.gaps, run before and after) loses more
than 0.1 T at once.
"""
import argparse
import csv
import json
import os
import statistics
import subprocess


def held_up(args):
    """Of frames of 2, 4 and 8 ms, percent."""
    path = os.path.join(args.out, "gaps.json")
    subprocess.run([os.path.join(args.bin, "haarlight-bench"), "--benchmark_filter=machine.gaps",
                    "--benchmark_repetitions=7", "--benchmark_min_time=0.4", f"--benchmark_out={path}"],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(path) as f:
        mean = next(b for b in json.load(f)["benchmarks"] if b.get("aggregate_name") == "mean")
    return {ms: mean[f"hit_percent_{ms:g}ms"] for ms in (2, 4, 8)}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("file")
    parser.add_argument("--env", required=True)
    parser.add_argument("--ms", default="4,8")
    parser.add_argument("--bin", default="build/bin")
    args = parser.parse_args()
    os.makedirs(args.out, exist_ok=True)
    print("| T | within 1.1 T | of T spent | wavelets, mean | lighting error, mean | frames that reset |"
          " late | held up from outside | by themselves | the same work again, late |"
          " spinning threads before, after |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    hit = held_up(args)
    for wanted in (float(t) for t in args.ms.split(",")):
        path = os.path.join(args.out, f"budget-{wanted:g}.csv")
        subprocess.run([os.path.join(args.bin, "haarlight-study"), "budget", args.file, "--env", args.env,
                        "--ms", f"{wanted:g}", "--frames", "1000", "--stop", "999", "--degrees", "360",
                        "-o", path], check=True)
        hit_before, hit = hit, held_up(args)
        with open(path) as f:
            rows = list(csv.DictReader(f))[1:]  # the first frame is exact, whatever it takes
        number = {name: [float(r[name]) for r in rows] for name in (
            "total_ms", "waited_ms", "again_median_ms", "wavelets", "lighting_error")}
        limit = 1.1 * wanted
        late = [i for i, t in enumerate(number["total_ms"]) if t > limit]
        outside = [i for i in late if number["waited_ms"][i] >= number["total_ms"][i] - limit
                   or number["again_median_ms"][i] <= limit]
        resets = sum("1" in r["resets"] for r in rows)
        again = sum(t > limit for t in number["again_median_ms"])
        print(f"| {wanted:g} ms | {100 * (1 - len(late) / len(rows)):.1f} % |"
              f" {100 * statistics.mean(number['total_ms']) / wanted:.1f} % |"
              f" {statistics.mean(number['wavelets']):.0f} |"
              f" {statistics.mean(number['lighting_error']):.3f} | {resets} |"
              f" {len(late)} | {len(outside)} | {len(late) - len(outside)} | {again} |"
              f" {hit_before.get(wanted, float('nan')):.1f} %, {hit.get(wanted, float('nan')):.1f} % |",
              flush=True)


if __name__ == "__main__":
    main()
