#!/usr/bin/env python3
"""A run of haarlight-bench as a table: time, spread, bytes moved, share of the read bandwidth.

    bench/kernel_table.py RUN.json [--only REGEX]

RUN.json is what `haarlight-bench --benchmark_out=RUN.json --benchmark_out_format=json` wrote, the
case memory.read among its cases. Spread is the standard deviation of the repetitions over their
mean.
"""
import argparse
import re
import sys

from compare import UNIT, Failure, benchmarks


def read(path):
    """Case -> {median, mean, stddev: of ms; bytes: a second, at the median; repetitions}."""
    cases = {}
    for run in benchmarks(path):
        if run.get("error_occurred"):
            raise Failure(f"{path}: {run['run_name']} says {run.get('error_message')}")
        kind = run.get("aggregate_name")
        if kind not in ("median", "mean", "stddev"):
            continue
        case = cases.setdefault(run["run_name"].split("/")[0], {"repetitions": run["repetitions"]})
        case[kind] = run["real_time"] * UNIT[run["time_unit"]]
        if kind == "median" and "bytes_per_second" in run:
            case["bytes"] = run["bytes_per_second"]
            case["MB"] = run.get("MB", run["bytes_per_second"] * case["median"] / 1e9)
    if "memory.read" not in cases:
        raise Failure(f"{path}: has no case memory.read, expected it for the share of it")
    return cases


def table(cases, only):
    """Lines of Markdown."""
    whole = cases["memory.read"]["bytes"]
    lines = ["| kernel | ms, median | spread | MB | GB/s | of the read bandwidth |",
             "| --- | --- | --- | --- | --- | --- |"]
    for name, case in cases.items():
        if "bytes" not in case or not re.search(only, name):
            continue
        lines.append(f"| `{name}` | {case['median']:.3g} | {100 * case['stddev'] / case['mean']:.1f} % |"
                     f" {case['MB']:.3g} | {case['bytes'] / 1e9:.1f} |"
                     f" {100 * case['bytes'] / whole:.0f} % |")
    fewest = min(case["repetitions"] for case in cases.values())
    return lines + ["", f"At least {fewest} repetitions a case."]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("run")
    parser.add_argument("--only", default="", metavar="REGEX")
    args = parser.parse_args()
    try:
        print("\n".join(table(read(args.run), args.only)))
    except Failure as failure:
        print(f"kernel_table.py: {failure}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
