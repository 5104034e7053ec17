#!/usr/bin/env python3
"""Is the plan honest? What leaving each effect out costs, estimated and measured, scene by scene.

  bench/effects.py OUT_DIR [--bin build/bin] [--size 96x96] [--face 32] [--quick]

For each scene: `haarlight plan`, then `haarlight precompute` with every effect, without each in turn
and with --effects auto; transports are compared by `haarlight compare`. Prints a Markdown table and
writes it to OUT_DIR/effects.md, effects.csv and auto.csv. "Noise" is that of both transports together
with what their storage rounds off, under the built-in lighting where it is largest; the two share
random numbers, so what is left in their difference may be much less.

What OUT_DIR holds from the same options is kept, so the command can be stopped and given again; start
in an empty folder when the program has changed. Times mean something on an idle machine only.
Scenes are those of haarlight-data; --scenes takes names and files.
"""
import argparse
import csv
import json
import math
import os
import re
import subprocess
import sys
import time

SCENES = ("cornell", "glass", "metals", "ring", "room", "spheres")
EFFECTS = ("shadows", "interreflection", "gloss", "specular", "caustics", "color")
JUDGED_ABOVE = 1e-3  # errors below are called equal
FACTOR = 2           # how far an estimate may be off
NOISY = 0.5          # of a measured error: more noise than that is said
JUDGED_SHARE = 0.1   # of the whole run's seconds or bytes: differences below are not judged
COLUMNS = ("scene", "left out", "estimated error", "measured error", "floor", "error ratio", "error",
           "estimated s", "measured s", "seconds", "estimated bytes", "measured bytes", "bytes")


def all_but(*effects):
    return ",".join(e for e in EFFECTS if e not in effects) or "none"


def rms(values):
    values = list(values)
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else 0.0


def shadow_error(open_to_direct, direct_to_all, all_to_direct):
    """Direct light without shadows against direct light with them, relative to the whole picture.

    Each list has, a lighting, the RMS difference relative to the RMS of the second of the pair; the
    last two differ by the ratio of those RMS, which turns the first into parts of the whole picture.
    """
    return rms(o * (d / a if a > 0 else 1)
               for o, d, a in zip(open_to_direct, direct_to_all, all_to_direct))


def judge_error(estimated, measured, floor):
    """Whether an estimate is within the factor of what the true error can be: from the measured one
    without noise and rounding, `floor`, to the measured one itself."""
    if max(estimated, measured) <= JUDGED_ABOVE:
        return "small"
    if measured / FACTOR <= estimated <= FACTOR * measured:
        return "within"
    least = math.sqrt(max(0.0, measured**2 - floor**2))
    if least / FACTOR <= estimated <= FACTOR * measured:
        return "within noise"
    return "OUTSIDE"


def judge_cost(estimated, measured, whole):
    """The same for seconds and bytes, which may be saved: then both are below 0."""
    if max(abs(estimated), abs(measured)) <= JUDGED_SHARE * whole:
        return "small"
    if estimated * measured > 0 and 1 / FACTOR <= estimated / measured <= FACTOR:
        return "within"
    return "OUTSIDE"


class Scene:
    """One scene's runs, kept in a folder of their own."""

    def __init__(self, name, args):
        self.args = args
        base = os.path.splitext(os.path.basename(name))[0]
        self.name, self.source = base, name
        self.folder = os.path.join(args.out, base)
        os.makedirs(self.folder, exist_ok=True)
        self.haarlight = os.path.join(args.bin, "haarlight")
        self.options = ["--size", args.size, "--face", str(args.face), "--noise", str(args.noise),
                        "--paths", str(args.paths)]

    def say(self, text):
        print(f"{self.name}: {text}", file=sys.stderr, flush=True)

    def program(self, *command):
        done = subprocess.run([str(c) for c in command], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True)
        if done.returncode != 0:
            raise SystemExit(f"{' '.join(map(str, command))}\nended with {done.returncode}: "
                             f"{done.stderr.strip().splitlines()[-1:]}")
        return done.stdout

    def kept(self, name, key, make):
        """The JSON that make() gives, from the folder if it was made by the same `key`."""
        path = os.path.join(self.folder, name + ".json")
        if os.path.exists(path):
            with open(path) as f:
                note = json.load(f)
            if note["key"] == key:
                return note["value"]
        value = make()
        with open(path + ".new", "w") as f:
            json.dump({"key": key, "value": value}, f, indent=1)
        os.replace(path + ".new", path)
        return value

    def file(self):
        if os.path.exists(self.source):
            return self.source
        path = os.path.join(self.folder, self.name + ".glb")
        if not os.path.exists(path):
            self.program(os.path.join(self.args.bin, "haarlight-data"), "scene", self.name, "-o", path)
        return path

    def plan(self, error):
        command = [self.haarlight, "plan", self.file(), *self.options, "--error", str(error), "--json"]

        def make():
            self.say(f"plan --error {error}")
            return json.loads(self.program(*command))
        return self.kept(f"plan_{error}", command, make)

    def transport(self, name, effects, error):
        """A run's seconds, bytes, noise and rounding; its file is made again if it is not there."""
        path = os.path.join(self.folder, name + ".hlt")
        command = [self.haarlight, "precompute", self.file(), "-o", path, "--effects", effects,
                   *self.options, "--error", str(error)]

        def make():
            self.say(f"{name}: --effects {effects} --error {error}")
            begin = time.monotonic()
            self.program(*command)
            seconds = time.monotonic() - begin
            self.say(f"{name}: {seconds:.1f} s, {os.path.getsize(path) / 2**20:.1f} MiB")
            made = json.loads(self.program(self.haarlight, "info", path, "--json"))["made"]
            return {"seconds": seconds, "bytes": os.path.getsize(path), "effects": made["effects"],
                    "floor": math.hypot(made.get("noise", 0), made["measured_error"])}
        note = os.path.join(self.folder, name + ".json")
        if not os.path.exists(path) and os.path.exists(note):
            os.remove(note)
        return dict(self.kept(name, command, make), path=path)

    def of_lightings(self, a, b):
        text = self.program(self.haarlight, "compare", a["path"], b["path"], "--json")
        return json.loads(text)["of_lightings"]

    def rows(self):
        """Rows of the table, and lines that say how the plan as a whole did."""
        fine, coarse = self.args.error, self.args.auto_error
        plan, auto_plan = self.plan(fine), self.plan(coarse)
        estimate = {row["effect"]: row for row in plan["rows"]}
        # What the scene cannot have costs nothing to leave out; that is measured all at once.
        possible = [e for e in EFFECTS if estimate[e]["needed"] or estimate[e]["error"] > 0]
        impossible = [e for e in EFFECTS if e not in possible]

        whole = self.transport("all", "all", fine)
        whole_seconds = max(whole["seconds"], plan["all_seconds"])
        whole_bytes = max(whole["bytes"], plan["all_bytes"])
        rows = []

        def add(effect, estimated, measured, floor, seconds, bytes_, estimated_seconds,
                estimated_bytes):
            rows.append({
                "scene": self.name, "left out": effect,
                "estimated error": estimated, "measured error": measured, "floor": floor,
                "error ratio": estimated / measured if measured > 0 else None,
                "error": judge_error(estimated, measured, floor),
                "estimated s": estimated_seconds, "measured s": seconds,
                "seconds": judge_cost(estimated_seconds, seconds, whole_seconds),
                "estimated bytes": estimated_bytes, "measured bytes": bytes_,
                "bytes": judge_cost(estimated_bytes, bytes_, whole_bytes)})

        for effect in possible:
            row = estimate[effect]
            if effect == "shadows":  # the plan's: of direct light alone
                beside = ("interreflection", "caustics")
                direct = self.transport("direct", all_but(*beside), fine)
                opened = self.transport("no_shadows", all_but("shadows", *beside), fine)
                error = shadow_error(self.of_lightings(opened, direct),
                                     self.of_lightings(direct, whole),
                                     self.of_lightings(whole, direct))
                with_, without = direct, opened
            else:
                with_, without = whole, self.transport("no_" + effect, all_but(effect), fine)
                error = rms(self.of_lightings(without, whole))
            add(effect, row["error"], error, math.hypot(with_["floor"], without["floor"]),
                with_["seconds"] - without["seconds"], with_["bytes"] - without["bytes"],
                row["seconds"], row["bytes"])
        if impossible:
            without = self.transport("no_others", all_but(*impossible), fine)
            add(", ".join(impossible), sum(estimate[e]["error"] for e in impossible),
                rms(self.of_lightings(without, whole)),
                math.hypot(whole["floor"], without["floor"]), whole["seconds"] - without["seconds"],
                whole["bytes"] - without["bytes"], 0, 0)

        # The plan followed: against everything, at the error that the user asked for.
        auto = self.transport("auto", "auto", coarse)
        coarse_all = self.transport("all_coarse", "all", coarse)
        error = rms(self.of_lightings(auto, coarse_all))
        summary = {
            "scene": self.name, "effects": auto["effects"],
            "estimated error": auto_plan["error"], "measured error": error,
            "within": error <= coarse, "floor": math.hypot(auto["floor"], coarse_all["floor"]),
            "against fine": rms(self.of_lightings(auto, whole)),
            "auto s": auto["seconds"], "estimated auto s": auto_plan["seconds"] + auto_plan["look_seconds"],
            "all s": coarse_all["seconds"], "estimated all s": auto_plan["all_seconds"],
            "auto bytes": auto["bytes"], "estimated auto bytes": auto_plan["bytes"],
            "all bytes": coarse_all["bytes"], "estimated all bytes": auto_plan["all_bytes"]}
        return {"rows": rows, "summary": summary}

    def study(self):
        key = ["2", self.options, self.args.error, self.args.auto_error, self.source]
        value = self.kept("result", key, self.rows)
        if not self.args.keep:
            for name in os.listdir(self.folder):
                if name.endswith(".hlt"):
                    os.remove(os.path.join(self.folder, name))
        return value


def percent(value):
    return f"{100 * value:.2f} %"


def pair(estimated, measured, form, verdict):
    mark = " **OUTSIDE**" if verdict == "OUTSIDE" else ""
    return f"{form(estimated)} / {form(measured)}{mark}"


def seconds_text(value):
    return f"{value:.1f} s"


def mib(value):
    return f"{value / 2**20:.2f} MiB"


def effects_table(rows):
    yield "| scene | left out | error: estimated | measured | noise | ratio | |" \
          " time it adds: est. / meas. | bytes it adds: est. / meas. |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for r in rows:
        ratio = f"{r['error ratio']:.2f}" if r["error ratio"] is not None else "-"
        error = f"**{r['error']}**" if r["error"] == "OUTSIDE" else r["error"]
        yield (f"| {r['scene']} | {r['left out']} | {percent(r['estimated error'])} |"
               f" {percent(r['measured error'])} | {percent(r['floor'])} | {ratio} | {error} |"
               f" {pair(r['estimated s'], r['measured s'], seconds_text, r['seconds'])} |"
               f" {pair(r['estimated bytes'], r['measured bytes'], mib, r['bytes'])} |")


def auto_table(summaries, error):
    yield (f"| scene | `--effects auto --error {error}` | error against all: est. / meas. | noise | within? |"
           " against all, finely stored | time (est. / meas.): auto | all | saved |"
           " bytes (est. / meas.): auto | all | saved |")
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for s in summaries:
        def cost(what, form):
            return [pair(s[f"estimated {kind} {what}"], s[f"{kind} {what}"], form,
                         judge_cost(s[f"estimated {kind} {what}"], s[f"{kind} {what}"], 0))
                    for kind in ("auto", "all")] + [
                        f"{100 * (1 - s['auto ' + what] / s['all ' + what]):.0f} %".replace("-0 %", "0 %")]
        cells = [s["scene"], s["effects"].replace(",", ", "),
                 f"{percent(s['estimated error'])} / {percent(s['measured error'])}",
                 percent(s["floor"]), "yes" if s["within"] else "**NO**", percent(s["against fine"]),
                 *cost("s", seconds_text), *cost("bytes", mib)]
        yield "| " + " | ".join(cells) + " |"


def verdicts(rows, summaries):
    judged = [r for r in rows if r["error"] != "small"]
    outside = [r for r in judged if r["error"] == "OUTSIDE"]
    noisy = [r for r in judged if r["error"] == "within noise"]
    yield (f"Errors above {percent(JUDGED_ABOVE)}: {len(judged)}; outside a factor of {FACTOR}: "
           f"{len(outside)}; within it only thanks to noise: {len(noisy)}.")
    for r in outside + noisy:
        yield (f"- {r['scene']}, {r['left out']}: estimated {percent(r['estimated error'])}, measured "
               f"{percent(r['measured error'])} (noise and rounding up to {percent(r['floor'])}): "
               f"{r['error']}")
    drowned = [f"{r['scene']} {r['left out']}" for r in judged
               if r["floor"] > NOISY * r["measured error"]]
    yield (f"- Rows whose noise and rounding may be more than half of the measured error, for which "
           f"more --paths are wanted: {len(drowned)}" +
           (f" ({'; '.join(drowned)})." if drowned else "."))
    for what in ("seconds", "bytes"):
        of = [r for r in rows if r[what] != "small"]
        bad = [f"{r['scene']} {r['left out']}" for r in of if r[what] == "OUTSIDE"]
        yield (f"- Added {what}, where above {100 * JUDGED_SHARE:.0f} % of the whole: {len(of)}; "
               f"outside a factor of {FACTOR}: {len(bad)}" + (f" ({'; '.join(bad)})." if bad else "."))
    for what in ("s", "bytes"):
        bad = [f"{s['scene']} {kind}" for s in summaries for kind in ("auto", "all")
               if judge_cost(s[f"estimated {kind} {what}"], s[f"{kind} {what}"], 0) == "OUTSIDE"]
        yield (f"- Whole runs, {'seconds' if what == 's' else what}: {2 * len(summaries)}; "
               f"outside a factor of {FACTOR}: {len(bad)}" + (f" ({'; '.join(bad)})." if bad else "."))
    bad = [f"{s['scene']} ({percent(s['measured error'])}, of which noise may be up to "
           f"{percent(s['floor'])})" for s in summaries if not s["within"]]
    yield ("- `auto` is within `--error` of `all` on " +
           (f"all {len(summaries)} scenes." if not bad else
            f"{len(summaries) - len(bad)} of {len(summaries)} scenes; NOT on {', '.join(bad)}."))


def write_results(out, rows, summaries, error):
    text = "\n".join([*effects_table(rows), "", *auto_table(summaries, error), "",
                      *verdicts(rows, summaries)]) + "\n"
    with open(os.path.join(out, "effects.md"), "w") as f:
        f.write(text)
    with open(os.path.join(out, "effects.csv"), "w", newline="") as f:
        writer = csv.DictWriter(f, COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    with open(os.path.join(out, "auto.csv"), "w", newline="") as f:
        writer = csv.DictWriter(f, list(summaries[0]))
        writer.writeheader()
        writer.writerows(summaries)
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--bin", default="build/bin")
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="NAME_OR_FILE")
    parser.add_argument("--size", help="of the pictures [96x96; quick: 48x48]")
    parser.add_argument("--face", type=int, help="texels along a face [32; quick: 16]")
    parser.add_argument("--noise", type=float, help="wanted of tiles [0.01; quick: 0.02]")
    parser.add_argument("--paths", type=int, help="most of a tile [8192; quick: 1024]")
    parser.add_argument("--error", type=float, default=0.001,
                        help="of the runs that measure one effect's error [0.001]")
    parser.add_argument("--auto-error", type=float, default=0.01,
                        help="of the run that follows the plan [0.01]")
    parser.add_argument("--quick", action="store_true", help="small pictures, more noise")
    parser.add_argument("--keep", action="store_true", help="keep the transports")
    args = parser.parse_args()
    small = args.quick
    args.size = args.size or ("48x48" if small else "96x96")
    args.face = args.face or (16 if small else 32)
    args.noise = args.noise or (0.02 if small else 0.01)
    args.paths = args.paths or (1024 if small else 8192)
    if not re.fullmatch(r"\d+x\d+", args.size):
        parser.error(f"--size is {args.size}, expected WxH")
    rows, summaries = [], []
    for name in args.scenes:
        result = Scene(name, args).study()
        rows += result["rows"]
        summaries.append(result["summary"])
        text = write_results(args.out, rows, summaries, args.auto_error)  # so far
    print(text, end="")


if __name__ == "__main__":
    main()
