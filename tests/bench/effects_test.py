#!/usr/bin/env python3
"""Does bench/effects.py judge rightly, and does it keep what it has?"""

import shutil
import sys
import tempfile
import types
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))
import effects  # noqa: E402


class Judging(unittest.TestCase):
    def test_errors(self):
        self.assertEqual(effects.judge_error(0.0009, 0.0001, 0), "small")
        self.assertEqual(effects.judge_error(0.019, 0.01, 0), "within")
        self.assertEqual(effects.judge_error(0.0051, 0.01, 0), "within")
        self.assertEqual(effects.judge_error(0.021, 0.01, 0), "OUTSIDE")
        self.assertEqual(effects.judge_error(0.0049, 0.01, 0), "OUTSIDE")
        self.assertEqual(effects.judge_error(0.0005, 0.01, 0), "OUTSIDE")

    def test_noise_excuses_low_estimates_only(self):
        # The truth may be anything from sqrt(0.01^2 - 0.008^2) = 0.006 to 0.01.
        self.assertEqual(effects.judge_error(0.0031, 0.01, 0.008), "within noise")
        self.assertEqual(effects.judge_error(0.0029, 0.01, 0.008), "OUTSIDE")
        self.assertEqual(effects.judge_error(0.021, 0.01, 0.008), "OUTSIDE")

    def test_costs(self):
        self.assertEqual(effects.judge_cost(1, 9, 100), "small")
        self.assertEqual(effects.judge_cost(-30, -20, 100), "within")
        self.assertEqual(effects.judge_cost(-30, 20, 100), "OUTSIDE")
        self.assertEqual(effects.judge_cost(0, 20, 100), "OUTSIDE")
        self.assertEqual(effects.judge_cost(41, 20, 100), "OUTSIDE")

    def test_shadows_are_relative_to_the_whole_picture(self):
        # RMS of the pictures: direct 2, all 4, their difference 3; open differs from direct by 1.
        self.assertAlmostEqual(effects.shadow_error([1 / 2], [3 / 4], [3 / 2]), 1 / 4)
        # Direct light is all there is.
        self.assertAlmostEqual(effects.shadow_error([0.3, 0.4], [0, 0], [0, 0]), 0.125**0.5)

    def test_lists_of_effects(self):
        self.assertEqual(effects.all_but("gloss", "color"),
                         "shadows,interreflection,specular,caustics")
        self.assertEqual(effects.all_but(*effects.EFFECTS), "none")


class Keeping(unittest.TestCase):
    def setUp(self):
        self.out = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.out)
        args = types.SimpleNamespace(out=self.out, bin="", size="8x8", face=4, noise=0.1, paths=1)
        self.scene = effects.Scene("box", args)

    def test_made_once_for_a_key(self):
        made = []
        for key in (["a"], ["a"], ["b"]):
            value = self.scene.kept("note", key, lambda: made.append(key) or len(made))
        self.assertEqual((made, value), ([["a"], ["b"]], 2))

    def test_rows_outside_are_named(self):
        row = {"scene": "box", "left out": "gloss", "estimated error": 0.05, "measured error": 0.01,
               "floor": 0.001, "error ratio": 5, "error": "OUTSIDE", "estimated s": 9,
               "measured s": 8, "seconds": "within", "estimated bytes": 50, "measured bytes": 10,
               "bytes": "OUTSIDE"}
        summary = {"scene": "box", "effects": "shadows", "estimated error": 0, "measured error": 0.02,
                   "within": False, "floor": 0.004, "against fine": 0.03}
        for what in ("s", "bytes"):
            summary |= {f"auto {what}": 10, f"estimated auto {what}": 10, f"all {what}": 20,
                        f"estimated all {what}": 90}
        text = effects.write_results(self.out, [row], [summary], 0.01)
        self.assertEqual(text, (Path(self.out) / "effects.md").read_text())
        for line in ("Errors above 0.10 %: 1; outside a factor of 2: 1;",
                     "- box, gloss: estimated 5.00 %, measured 1.00 %",
                     "Added bytes, where above 10 % of the whole: 1; outside a factor of 2: 1 (box",
                     "Added seconds, where above 10 % of the whole: 1; outside a factor of 2: 0.",
                     "Whole runs, seconds: 2; outside a factor of 2: 1 (box all).", "NOT on box (2.00 %, of which noise may be up to 0.40 %)",
                     "more --paths are wanted: 0."):
            self.assertIn(line, text)
        self.assertEqual((Path(self.out) / "effects.csv").read_text().count("\n"), 2)


if __name__ == "__main__":
    unittest.main()
