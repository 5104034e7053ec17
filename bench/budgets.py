#!/usr/bin/env python3
"""How well `--budget-ms T` is kept: frames within 1.1 T, time spent, and which frames are late.

  bench/budgets.py OUT_DIR FILE.hlt --env A.exr [--ms 4,8] [--bin build/bin]

1,000 frames of `rotate` by 360 degrees. A frame is late for its bytes if it moved more than 1.25
times the median of the 31 frames around it, and else for its pace.
"""
import argparse
import csv
import os
import statistics
import subprocess


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
    print("| T | within 1.1 T | of T spent | wavelets, mean | frames that reset, late | others, late |"
          " late for bytes | late for pace |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for wanted in (float(t) for t in args.ms.split(",")):
        path = os.path.join(args.out, f"budget-{wanted:g}.csv")
        subprocess.run([os.path.join(args.bin, "haarlight"), "relight", args.file, "--env", args.env,
                        "--budget-ms", f"{wanted:g}", "--frames", "1000", "--stop", "999",
                        "--degrees", "360", "--no-estimate", "--metrics", path],
                       check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
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
              f" {of_resets} of {len(resets)} | {len(late) - of_resets} of {len(rows) - len(resets)} |"
              f" {for_bytes} | {len(late) - for_bytes} |", flush=True)


if __name__ == "__main__":
    main()
