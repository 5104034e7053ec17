#!/usr/bin/env python3
"""Makes the table of docs/stability.md from what the hard cases' tests have just reported.

    stability_table.py [--reports build/hard_cases] [--doc docs/stability.md] [--binaries build/bin]
                       [--check]

ctest leaves a report for every test (see tests/hard/hard_case.h). Without --check the lines between
the markers of the document are replaced. With --check nothing is written: exit code 1 if rows,
properties, tests or limits of the document are not those of the reports, one line for each
difference. Figures are of a machine and a run, and are not compared, nor are tests that were skipped.
Reports of tests that no binary has any more count for nothing.
"""

import argparse
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

BEGIN, END = "<!-- table: made by tests/hard/stability_table.py -->", "<!-- end of table -->"
HEAD = ["| row | property | test | measured | limit |", "| --- | --- | --- | --- | --- |"]
SUITE = "HardCases"
NAME = re.compile(r"Row(\d+)_(\w+)")


def present(folder):
    """Names of the tests that the binaries hold."""
    names = set()
    for binary in sorted(folder.glob("test_hard_*")):
        listed = subprocess.run([str(binary), "--gtest_list_tests"], capture_output=True, text=True,
                                check=True).stdout
        names |= {line.split()[0] for line in listed.splitlines() if line.startswith("  ")}
    return names


def reported(folder, names):
    """{test name: (property, [(what, figure, relation, limit)])} of all reports, and names of the
    tests that were skipped."""
    tests, skipped = {}, set()
    for path in sorted(folder.glob("*.xml")):
        for case in ElementTree.parse(path).getroot().iter("testcase"):
            name = case.get("name")
            if case.get("classname") != SUITE or not NAME.fullmatch(name) or name not in names:
                continue
            if case.get("status") != "run" or case.get("result") == "skipped":
                skipped.add(name)
                continue
            text, figures = "", []
            for item in case.iter("property"):
                if item.get("name") == "property":
                    text = item.get("value")
                elif item.get("name").startswith("figure_"):
                    figures.append(tuple(item.get("value").rsplit("|", 3)))
            tests[name] = (text, figures)
    return tests, skipped


def lines_of(tests):
    """Table lines in the order of rows: (line without figures, line)."""
    for name in sorted(tests, key=lambda n: (int(NAME.fullmatch(n).group(1)), n)):
        text, figures = tests[name]
        row = int(NAME.fullmatch(name).group(1))
        relation = {"<=": "≤", ">=": "≥"}
        what = "; ".join(w for w, _, _, _ in figures)
        measured = "; ".join(f"{w}: {f}" for w, f, _, _ in figures)
        limit = "; ".join(f"{relation[r]} {limit}" for _, _, r, limit in figures)
        safe = [cell.replace("|", "\\|") for cell in (text, measured, limit, what)]
        yield (f"{row} | {safe[0]} | {name} | {safe[3]} | {safe[2]}",
               f"| {row} | {safe[0]} | `{name}` | {safe[1]} | {safe[2]} |")


def without_figures(line):
    """The comparable part of a table line of the document."""
    cells = [c.strip().replace("\0", "\\|") for c in line.replace("\\|", "\0").strip("|\n ").split("|")]
    if len(cells) != 5:
        return line.strip()
    what = "; ".join(part.rsplit(": ", 1)[0] for part in cells[3].split("; "))
    return " | ".join([cells[0], cells[1], cells[2].strip("`"), what, cells[4]])


def split_document(doc):
    text = doc.read_text()
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        sys.exit(f"{doc}: wanted the two lines '{BEGIN}' and '{END}' once")
    before, rest = text.split(BEGIN)
    table, after = rest.split(END)
    return before, [line for line in table.splitlines() if line.strip()], after


def differences(doc_lines, tests, skipped):
    stated = {without_figures(line) for line in doc_lines if line not in HEAD}
    stated = {key for key in stated if not skipped.intersection(key.split(" | "))}
    found = {key for key, _ in lines_of(tests)}
    for key in sorted(stated - found):
        yield f"the document states what no test reports: {key}"
    for key in sorted(found - stated):
        yield f"a test reports what the document does not state: {key}"


def main():
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--reports", type=Path, default=root / "build/hard_cases")
    parser.add_argument("--doc", type=Path, default=root / "docs/stability.md")
    parser.add_argument("--binaries", type=Path, default=root / "build/bin")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    tests, skipped = reported(options.reports, present(options.binaries))
    if not tests:
        sys.exit(f"{options.reports}: no report of a hard case, wanted those of ctest -L hard")
    before, doc_lines, after = split_document(options.doc)
    if options.check:
        problems = list(differences(doc_lines, tests, skipped))
        print("\n".join(problems) or f"{len(tests)} tests as {options.doc} states them")
        return 1 if problems else 0
    table = HEAD + [line for _, line in lines_of(tests)]
    if skipped:
        sys.exit(f"skipped: {', '.join(sorted(skipped))}; the table wants all tests")
    options.doc.write_text(before + BEGIN + "\n\n" + "\n".join(table) + "\n\n" + END + after)
    print(f"{options.doc}: {len(tests)} tests")
    return 0


if __name__ == "__main__":
    sys.exit(main())
