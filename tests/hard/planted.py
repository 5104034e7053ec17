#!/usr/bin/env python3
"""Can the hard cases' tests fail? Plants one fault after the other and watches the row turn red.

    planted.py [--tree build/planted] [--only REGEX] [--jobs 2] [--prefix CMD] [--cmake ARG] [--resume]
               [--apply-only]

planted/NN_name.patch is a fault that row NN must catch; its first lines say what it is:
    Fault: sums in float
    Red: HardCases.Row01_*        (which tests must fail; by default all of the row's)
    Binary: test_hard_numbers     (which holds them; by default the one of tests/hard that does)
What is not about a row has no number before its name, and says Red and Binary.
The tree is copied, built and found green; then each fault is applied, the one binary that holds its
row is built and run, and the fault is taken back. A fault that does not compile is an error, one
that the row survives is "not caught". Prints a table; exit code 1 unless all are caught.
What has been seen is kept in planted.json of the tree, with hashes of the sources and of the patches;
--resume goes on from there with what is the same still.
--apply-only asks just whether every patch fits the tree as it is (a test of the suite).
"""

import argparse
import fnmatch
import hashlib
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PATCHES = Path(__file__).resolve().parent / "planted"
RUN_LIMIT = 300  # seconds; a hang is caught, too
# Properties as the suite has them, but not shrunk: that they fail is enough, and shrinking takes minutes.
ENVIRONMENT = {**os.environ, "RC_PARAMS": "seed=7 max_success=100 noshrink=1"}


class Fault:
    def __init__(self, path):
        self.path = path
        self.name = path.stem
        row = re.match(r"(\d+)_", self.name)
        head = path.read_text().split("\n--- ")[0]
        said = re.search(r"^Fault: (.+)$", head, re.MULTILINE)
        if not said:
            sys.exit(f"{path}: wanted a line 'Fault: what is wrong'")
        red = re.search(r"^Red: (\S+)$", head, re.MULTILINE)
        binary = re.search(r"^Binary: (\S+)$", head, re.MULTILINE)
        if not row and not (red and binary):
            sys.exit(f"{path}: wanted a name that begins with the number of its row, or Red and Binary")
        self.what = said.group(1)
        self.binary = binary.group(1) if binary else None
        self.hash = hashlib.sha256(path.read_bytes()).hexdigest()
        self.red = red.group(1) if red else f"HardCases.Row{int(row.group(1)):02d}_*"


def run(command, **options):
    return subprocess.run(command, capture_output=True, text=True, **options)


def copy_tree(tree):
    """The files of the checkout, those not yet committed as well; unchanged ones keep their times."""
    listed = run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, check=True).stdout.split("\n")
    wanted = {name for name in listed if name and (ROOT / name).is_file()}
    for old in tree.rglob("*"):
        name = old.relative_to(tree).as_posix()
        if old.is_file() and name not in wanted and not name.startswith(("build/", "planted.json")):
            old.unlink()
    for name in wanted:
        source, target = ROOT / name, tree / name
        if target.exists() and target.read_bytes() == source.read_bytes():
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, target)
        shutil.copymode(source, target)


def apply(fault, tree, *options):
    return run(["patch", "-p1", "--forward", "--no-backup-if-mismatch", "-r", "-", "-i",
                str(fault.path), *options], cwd=tree)


class Seen:
    """Lines of the table so far, for one state of the sources; each with its patch's hash."""

    def __init__(self, tree, resume):
        self.path = tree / "planted.json"
        digest = hashlib.sha256()
        for path in sorted(p for p in tree.rglob("*") if p.is_file()):
            name = path.relative_to(tree).as_posix()
            if name != self.path.name and not name.startswith(("build/", "docs/", "tests/hard/planted")):
                digest.update(name.encode() + b"\0" + path.read_bytes())
        self.state = digest.hexdigest()
        self.lines, self.green = {}, []
        if resume and self.path.exists():
            kept = json.loads(self.path.read_text())
            if kept["state"] == self.state:
                self.lines, self.green = kept["lines"], kept["green"]

    def line(self, fault):
        """(caught, line), or nothing."""
        caught, line, patch = self.lines.get(fault.name, (False, "", ""))
        return (caught, line) if patch == fault.hash else None

    def add(self, fault, caught, line):
        self.lines[fault.name] = (caught, line, fault.hash)
        self.keep()

    def keep(self):
        self.path.write_text(json.dumps({"state": self.state, "green": self.green,
                                         "lines": self.lines}))


class Build:
    def __init__(self, tree, jobs, prefix, arguments):
        folder = tree / "build"
        self.folder, self.jobs, self.prefix = folder, jobs, prefix
        self.command(["cmake", "-S", str(tree), "-B", str(folder), "-G", "Ninja",
                      "-DHAARLIGHT_BUILD_TESTS=ON", "-DHAARLIGHT_BUILD_BENCH=OFF", *arguments],
                     must=True)
        targets = self.command(["cmake", "--build", str(folder), "--target", "help"], must=True).stdout
        self.binaries = sorted(set(re.findall(r"^(test_hard_\w+):", targets, re.MULTILINE)))

    def command(self, words, must=False, **options):
        result = run(self.prefix + words, **options)
        if must and result.returncode != 0:
            sys.exit(f"{' '.join(words)} failed:\n{result.stdout[-3000:]}{result.stderr[-1000:]}")
        return result

    def make(self, *targets, must=False):
        return self.command(["cmake", "--build", str(self.folder), "-j", str(self.jobs), "--target",
                             *targets], must=must)

    def list_tests(self, binary):
        """What a binary's tests are called."""
        listed = self.command([str(self.folder / "bin" / binary), "--gtest_list_tests"],
                              must=True).stdout
        suite, names = "", []
        for line in listed.splitlines():
            if line.startswith("  "):
                names.append(suite + line.split("#")[0].strip())
            elif line.split("#")[0].strip().endswith("."):
                suite = line.split("#")[0].strip()
        return names

    def passes(self, binary, pattern):
        try:
            result = self.command([str(self.folder / "bin" / binary), f"--gtest_filter={pattern}"],
                                  timeout=RUN_LIMIT, env=ENVIRONMENT)
        except subprocess.TimeoutExpired:
            return False, "hangs"
        lines = [line for line in result.stdout.splitlines() if "allowed" in line or "wanted" in line]
        why = lines[0] if lines else (result.stdout + result.stderr).strip().splitlines()[-1]
        return result.returncode == 0, why.strip()


def plant_all(faults, tree, build, seen):
    print("| fault | what | caught | by |\n| --- | --- | --- | --- |", flush=True)
    missed = []
    for fault, binary in faults:
        if known := seen.line(fault):
            caught, line = known
            print(line, flush=True)
            if not caught:
                missed.append(fault)
            continue
        applied = apply(fault, tree)
        if applied.returncode != 0:
            sys.exit(f"{fault.path}: does not apply:\n{applied.stdout}")
        built = build.make(binary)
        if built.returncode != 0:
            green, why = True, "does not compile: " + next(
                (line for line in built.stdout.splitlines() if "error:" in line), "")
        else:
            green, why = build.passes(binary, fault.red)
        if green:
            missed.append(fault)
        caught = "no" if green else "yes"
        why = why.replace("|", "\\|")[:120]
        line = f"| {fault.name} | {fault.what} | {caught} | {why} |"
        print(line, flush=True)
        back = apply(fault, tree, "--reverse")
        if back.returncode != 0:
            sys.exit(f"{fault.path}: cannot be taken back:\n{back.stdout}")
        seen.add(fault, not green, line)
    return missed


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--tree", type=Path, default=ROOT / "build/planted")
    parser.add_argument("--only", default="", help="regular expression of the faults' names")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--prefix", default="", help="put before every build and run: 'nice -n 5'")
    parser.add_argument("--cmake", default="", help="further arguments of cmake")
    parser.add_argument("--resume", action="store_true")
    parser.add_argument("--apply-only", action="store_true")
    options = parser.parse_args()
    faults = [Fault(path) for path in sorted(PATCHES.glob("*.patch"))]
    faults = [fault for fault in faults if re.search(options.only, fault.name)]
    if not faults:
        sys.exit(f"{PATCHES}: no fault by that name")
    if options.apply_only:
        stale = [fault for fault in faults if apply(fault, ROOT, "--dry-run").returncode != 0]
        for fault in stale:
            print(f"{fault.path}: does not fit the tree any more")
        print(f"{len(faults) - len(stale)} of {len(faults)} faults fit")
        return 1 if stale else 0

    tree = options.tree.resolve()
    tree.mkdir(parents=True, exist_ok=True)
    copy_tree(tree)
    seen = Seen(tree, options.resume)
    build = Build(tree, options.jobs, shlex.split(options.prefix), shlex.split(options.cmake))
    named = {fault.binary for fault in faults if fault.binary}
    build.binaries = sorted(named if all(f.binary for f in faults) else named | set(build.binaries))
    build.make(*build.binaries, must=True)
    tests = {binary: build.list_tests(binary) for binary in build.binaries}
    placed = []
    for fault in faults:
        binary = next((b for b in build.binaries if fault.binary in (None, b)
                       and any(fnmatch.fnmatchcase(name, fault.red) for name in tests[b])), None)
        if not binary:
            sys.exit(f"{fault.path}: no test is called {fault.red}")
        placed.append((fault, binary))
    for binary, red in sorted({(b, f.red) for f, b in placed}):
        if red in seen.green:
            continue
        green, why = build.passes(binary, red)
        if not green:
            sys.exit(f"{binary} {red}: fails without a fault: {why}")
        seen.green.append(red)
        seen.keep()
    placed.sort(key=lambda p: (p[1], p[0].name))
    missed = plant_all(placed, tree, build, seen)
    print(f"\n{len(placed) - len(missed)} of {len(placed)} faults caught")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
