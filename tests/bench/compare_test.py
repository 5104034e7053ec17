#!/usr/bin/env python3
"""Does bench/compare.py tell slower from noise?"""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

COMPARE = Path(__file__).resolve().parents[2] / "bench" / "compare.py"


def case(name, median, deviation, repetitions=7, unit="ms"):
    return [{"run_name": name, "aggregate_name": kind, "real_time": value, "time_unit": unit,
             "repetitions": repetitions} for kind, value in (("median", median), ("stddev", deviation))]


class Comparing(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def file(self, name, *cases):
        path = Path(self.folder.name) / name
        path.write_text(json.dumps({"benchmarks": [run for c in cases for run in c]}))
        return path

    def compare(self, old, new, *options):
        return subprocess.run([sys.executable, COMPARE, old, new, *options], capture_output=True,
                              text=True)

    def test_slower_beyond_noise(self):
        # Spread of a median of 7 with deviation 0.02: 0.0095; of the difference 0.0134; 3 of it 0.04.
        old = self.file("old.json", case("a", 1, 0.02), case("b", 1, 0.02), case("c", 1, 0.02))
        new = self.file("new.json", case("a", 1.05, 0.02), case("b", 1.035, 0.02), case("c", 0.9, 0.02))
        result = self.compare(old, new)
        lines = result.stdout.splitlines()
        self.assertEqual(result.returncode, 1)
        self.assertTrue(lines[0].endswith("+5.0 %  SLOWER"), lines[0])
        self.assertTrue(lines[1].endswith("+3.5 %"), lines[1])
        self.assertTrue(lines[2].endswith("-10.0 %  FASTER"), lines[2])
        self.assertEqual(lines[3], "1 of 3 cases are slower beyond noise")

    def test_more_repetitions_see_more(self):
        for repetitions, code in ((7, 0), (70, 1)):
            old = self.file("old.json", case("a", 1, 0.04, repetitions))
            new = self.file("new.json", case("a", 1.05, 0.04, repetitions))
            self.assertEqual(self.compare(old, new).returncode, code)

    def test_small_changes_do_not_count(self):
        old, new = self.file("old.json", case("a", 1, 0)), self.file("new.json", case("a", 1.02, 0))
        self.assertEqual(self.compare(old, new).returncode, 0)
        self.assertEqual(self.compare(old, new, "--at-least", "0.01").returncode, 1)

    def test_units_and_cases_that_come_and_go(self):
        old = self.file("old.json", case("a", 1000, 1, unit="us"), case("gone", 1, 0))
        new = self.file("new.json", case("a", 1, 0.001), case("new", 2, 0))
        result = self.compare(old, new)
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertIn("gone                                 is gone", result.stdout)
        self.assertIn("is new: 2.0000 ms", result.stdout)
        self.assertIn("+0.0 %", result.stdout)

    def test_other_files_are_refused_in_a_line(self):
        good = self.file("good.json", case("a", 1, 0))
        empty, text = self.file("empty.json"), Path(self.folder.name) / "text"
        text.write_text("no JSON")
        for bad in (empty, text, Path(self.folder.name) / "missing.json"):
            result = self.compare(bad, good)
            self.assertEqual(result.returncode, 2)
            self.assertEqual(len(result.stderr.splitlines()), 1)
            self.assertIn(str(bad), result.stderr)


if __name__ == "__main__":
    unittest.main()
