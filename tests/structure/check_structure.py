#!/usr/bin/env python3
"""Checks the tree's own rules: who includes whom, compiler flags, formatting.

    check_structure.py [--root DIR]      prints what breaks a rule, one line each; exit code 1 if any

1. A folder includes only the folders it may use (USES), by paths from the root of the tree.
2. Third-party headers enter through few places (PLACES).
3. No build file asks for fast-math: results must not depend on the compiler's liberties.
4. Files are as .clang-format has them, where clang-format 14 (Debian 12's) is installed; other
   versions format differently.
"""

import argparse
import re
import shutil
import subprocess
import sys
from pathlib import Path

LIBRARY = {"core", "wavelet", "prt", "cpca", "precompute", "caching"}
EVERY = LIBRARY | {"viewer", "apps", "bench", "data_gen", "tests"}
# Folder: what it may include besides itself.
USES = {
    "core": set(),
    "wavelet": {"core"},
    "prt": {"core", "wavelet"},
    "cpca": {"core", "wavelet", "prt"},
    "precompute": {"core", "wavelet", "prt"},
    "caching": {"core", "wavelet", "prt", "precompute"},
    "viewer": LIBRARY,
    "apps": LIBRARY | {"viewer"},
    "bench": EVERY,
    "data_gen": {"core", "wavelet", "precompute"},
    "tests": EVERY,
    "examples": LIBRARY,
}

# Third-party header: files of the tree that may include it. Tests and benchmarks may include any.
PLACES = [
    (r"OpenImageIO/|OpenEXR/|Imath/|Imf|half\.h", r"core/image[^/]*"),
    (r"embree[34]?/", r"precompute/.*"),
    (r"assimp/", r"precompute/.*"),
    (r"GLFW/|imgui", r"viewer/.*"),
    (r"GL/|GLES|glad/|epoxy/", r"viewer/.*"),
    (r"mpi\.h", r"apps/mpi_distribution\.cpp"),
    (r"CLI/", r"(apps|viewer|data_gen|examples)/.*"),
    (r"gtest/|gmock/|rapidcheck", r"$^"),
    (r"benchmark/", r"$^"),
]
ANYTHING_GOES = ("tests/", "bench/")

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SOURCES = (".h", ".cpp", ".cu", ".cuh", ".inl")
FAST_MATH = re.compile(r"-ffast-math|-Ofast|-funsafe-math-optimizations|-ffinite-math-only|fp:fast")


def is_build_file(path):
    return path.name == "CMakeLists.txt" or path.suffix in (".cmake", ".sh") or path.name == "CMakePresets.json"


def tree_files(root):
    """Files of the tree, without build folders and what a demo leaves."""
    for path in sorted(root.rglob("*")):
        parts = path.relative_to(root).parts
        hidden = any(part.startswith(".") for part in parts)
        made = len(parts) > 1 and (parts[0].startswith("build") or parts[0] in ("out", "data"))
        if path.is_file() and not hidden and not made:
            yield path


def check_includes(root, path):
    name = path.relative_to(root).as_posix()
    folder = name.split("/")[0]
    if folder not in USES:
        yield f"{name}: stands in folder '{folder}', which has no line in the table of folders"
        return
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        found = INCLUDE.match(line)
        if not found:
            continue
        bracket, header = found.groups()
        target = header.split("/")[0]
        if bracket == '"':
            if "/" not in header or target not in EVERY:
                yield f'{name}:{number}: "{header}" is no path from the root of the tree'
            elif target != folder and target not in USES[folder]:
                yield f"{name}:{number}: {folder}/ includes {header}, but may use only {sorted(USES[folder])}"
        elif target in EVERY and "/" in header and (root / header).exists() and folder != "examples":
            yield f"{name}:{number}: <{header}> is the tree's own, wanted in quotes"
        elif not name.startswith(ANYTHING_GOES):
            for pattern, place in PLACES:
                if re.match(pattern, header) and not re.fullmatch(place, name):
                    yield f"{name}:{number}: <{header}> may enter only through {place}"


def check_flags(root, path):
    for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
        if FAST_MATH.search(line.split("#")[0]):
            yield f"{path.relative_to(root).as_posix()}:{number}: fast-math is forbidden"


def clang_format_14():
    for name in ("clang-format-14", "clang-format"):
        program = shutil.which(name)
        if program:
            version = subprocess.run([program, "--version"], capture_output=True, text=True).stdout
            if re.search(r"version 14\.", version):
                return program
    return None


def check_format(root, program, paths):
    if not paths:
        return
    result = subprocess.run([program, "--dry-run", "--style=file", *map(str, paths)],
                            capture_output=True, text=True)
    for file in sorted(set(re.findall(r"^(.+?):\d+:\d+: warning:", result.stderr, re.MULTILINE))):
        yield f"{Path(file).relative_to(root).as_posix()}: is not as .clang-format has it"
    if result.returncode != 0:
        yield f"clang-format failed: {result.stderr.strip().splitlines()[-1]}"


def check(root):
    problems, sources = [], []
    for path in tree_files(root):
        if path.suffix in SOURCES:
            sources.append(path)
            problems += check_includes(root, path)
        elif is_build_file(path):
            problems += check_flags(root, path)
    program = clang_format_14()
    if program and (root / ".clang-format").exists():
        problems += check_format(root, program, sources)
    return problems, len(sources), program


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parents[2])
    root = parser.parse_args().root.resolve()
    problems, count, program = check(root)
    print(f"{count} source files, formatting checked by {program or 'nothing: no clang-format 14'}")
    if count == 0:
        problems.append(f"{root}: holds no source files")
    for problem in problems:
        print(problem)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
