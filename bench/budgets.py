#!/usr/bin/env python3
"""How well `--budget-ms T` is kept: frames within 1.1 T, time spent, and which frames are late.

  bench/budgets.py OUT_DIR FILE.hlt --env A.exr [--ms 4,8] [--bin build/bin]

1,000 frames of `rotate` by 360 degrees. A frame is late for its bytes if it moved more than 1.25
times the median of the 31 frames around it, and else for its pace. Switches are those that the
system forced upon its threads, a frame; *held up* is the share of frames of length T in which one of
as many threads that do nothing but spin (`haarlight-bench`, case machine.gaps, run before and after) loses more
than 0.1 T at once: a time without parts would be late for these alone.
"""
import argparse
import csv
import json
import os
import resource
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
    print("| T | within 1.1 T | of T spent | wavelets, mean | lighting error, mean |"
          " frames that reset, late | others, late | late for bytes | late for pace |"
          " forced switches a frame | held up before, after |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    hit = held_up(args)
    for wanted in (float(t) for t in args.ms.split(",")):
        switches = resource.getrusage(resource.RUSAGE_CHILDREN).ru_nivcsw
        path = os.path.join(args.out, f"budget-{wanted:g}.csv")
        subprocess.run([os.path.join(args.bin, "haarlight"), "relight", args.file, "--env", args.env,
                        "--budget-ms", f"{wanted:g}", "--frames", "1000", "--stop", "999",
                        "--degrees", "360", "--no-estimate", "--metrics", path],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        switches = resource.getrusage(resource.RUSAGE_CHILDREN).ru_nivcsw - switches
        hit_before, hit = hit, held_up(args)
        with open(path) as f:
            rows = list(csv.DictReader(f))[1:]  # the first frame is exact, whatever it takes
        time = [float(r["total_ms"]) for r in rows]
        moved = [float(r["bytes"]) for r in rows]
        late = [i for i, t in enumerate(time) if t > 1.1 * wanted]
        resets = [i for i, r in enumerate(rows) if "1" in r["resets"]]
        of_resets = len(set(late) & set(resets))
        for_bytes = sum(moved[i] > 1.25 * statistics.median(moved[max(0, i - 15):i + 16])
                        for i in late)
        print(f"| {wanted:g} ms | {100 * (1 - len(late) / len(rows)):.1f} % |"
              f" {100 * statistics.mean(time) / wanted:.1f} % |"
              f" {statistics.mean(float(r['wavelets']) for r in rows):.0f} |"
              f" {statistics.mean(float(r['lighting_error']) for r in rows):.3f} |"
              f" {of_resets} of {len(resets)} | {len(late) - of_resets} of {len(rows) - len(resets)} |"
              f" {for_bytes} | {len(late) - for_bytes} | {switches / (len(rows) + 1):.2f} |"
              f" {hit_before.get(wanted, float('nan')):.1f} %, {hit.get(wanted, float('nan')):.1f} % |",
              flush=True)


if __name__ == "__main__":
    main()
