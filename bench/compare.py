#!/usr/bin/env python3
"""Says what got slower, or faster, beyond noise between two runs of haarlight-bench.

    haarlight-bench ... --benchmark_out=OLD.json --benchmark_out_format=json     # and NEW.json later
    bench/compare.py OLD.json NEW.json [--at-least 0.03]

A case is slower if its median time rose by more than noise: 3 times the spread of the medians, taken
from the standard deviations of both runs' repetitions (sqrt(pi / 2) s / sqrt(n) each), and by more
than --at-least of the old time. Exit code 1 if any case is slower, 0 otherwise, 2 for files that are
not what they should be.
"""

import argparse
import json
import math
import sys

UNIT = {"ns": 1e-6, "us": 1e-3, "ms": 1, "s": 1e3}
SIGMAS = 3
MEDIAN_SPREAD = math.sqrt(math.pi / 2)  # of the median of normal numbers, over that of their mean


class Failure(Exception):
    """A message for the user, one line."""


def benchmarks(path):
    """What haarlight-bench wrote, case by case and repetition by repetition."""
    try:
        with open(path) as f:
            return json.load(f)["benchmarks"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise Failure(f"{path}: no JSON of Google Benchmark ({error})") from error


def read(path):
    """Case -> {median, deviation, repetitions}, in milliseconds."""
    cases = {}
    for run in benchmarks(path):
        kind = run.get("aggregate_name")
        if kind not in ("median", "stddev") or run.get("error_occurred"):
            continue
        case = cases.setdefault(run["run_name"], {"repetitions": run.get("repetitions", 1)})
        case[kind] = run["real_time"] * UNIT[run.get("time_unit", "ns")]
    whole = {name: case for name, case in cases.items() if "median" in case and "stddev" in case}
    if not whole:
        raise Failure(f"{path}: no medians with their spread, expected runs of several repetitions")
    return whole


def judge(old, new, at_least):
    """'slower', 'faster' or 'same', and the change relative to the old time."""
    spread = math.hypot(*(MEDIAN_SPREAD * c["stddev"] / math.sqrt(c["repetitions"])
                          for c in (old, new)))
    difference = new["median"] - old["median"]
    change = difference / old["median"] if old["median"] > 0 else 0
    if abs(difference) <= SIGMAS * spread or abs(change) <= at_least:
        return "same", change
    return ("slower" if difference > 0 else "faster"), change


def compare(old, new, at_least):
    """Lines of text, and the number of slower cases."""
    lines, slower = [], 0
    for name in [n for n in old if n in new]:
        verdict, change = judge(old[name], new[name], at_least)
        slower += verdict == "slower"
        mark = "" if verdict == "same" else verdict.upper()
        lines.append(f"{name:<36} {old[name]['median']:10.4f} ms {new[name]['median']:10.4f} ms "
                     f"{100 * change:+7.1f} %  {mark}".rstrip())
    for name in [n for n in old if n not in new]:
        lines.append(f"{name:<36} is gone")
    for name in [n for n in new if n not in old]:
        lines.append(f"{name:<36} is new: {new[name]['median']:.4f} ms")
    lines.append(f"{slower} of {sum(n in new for n in old)} cases are slower beyond noise")
    return lines, slower


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--at-least", type=float, default=0.03, metavar="SHARE",
                        help="of the old time; less is never called slower [0.03]")
    args = parser.parse_args()
    try:
        lines, slower = compare(read(args.old), read(args.new), args.at_least)
    except Failure as failure:
        print(f"compare.py: {failure}", file=sys.stderr)
        return 2
    print("\n".join(lines))
    return 1 if slower else 0


if __name__ == "__main__":
    sys.exit(main())
