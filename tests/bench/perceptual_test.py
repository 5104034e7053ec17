#!/usr/bin/env python3
"""Is bench/perceptual.py the LDR-FLIP of Andersson and others 2020? Against a version of loops over
pixels and whole kernels, as the paper has it, and known CIELAB colours."""

import math
import os
import random
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))
try:
    import numpy as np
    import perceptual
except ImportError:
    system = "/usr/bin/python3"  # whose numpy is Debian's python3-numpy
    if os.path.exists(system) and not os.path.samefile(sys.executable, system) and "again" not in sys.argv:
        os.execv(system, [system, __file__, "again"])
    print("SKIPPED: numpy is not here")
    sys.exit(0)

PPD = 67
XYZ = [[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
       [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
       [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]]
WHITE = [sum(row) for row in XYZ]


def to_xyz(c):
    return [sum(m * x for m, x in zip(row, c)) / w for row, w in zip(XYZ, WHITE)]


def from_xyz(c):
    return [float(x) for x in np.linalg.solve(np.array(XYZ), np.array(c) * WHITE)]


def hunt_lab(c):
    f = [t**(1 / 3) if t > (6 / 29)**3 else t / (3 * (6 / 29)**2) + 4 / 29 for t in to_xyz(c)]
    light = 116 * f[1] - 16
    return light, 0.01 * light * 500 * (f[0] - f[1]), 0.01 * light * 200 * (f[1] - f[2])


def hyab(a, b):
    return abs(a[0] - b[0]) + math.hypot(a[1] - b[1], a[2] - b[2])


def mean_about(picture, y, x, kernel, r):
    rows, columns = len(picture), len(picture[0])
    return sum(kernel[j + r][i + r] * picture[min(max(y + j, 0), rows - 1)][min(max(x + i, 0), columns - 1)]
               for j in range(-r, r + 1) for i in range(-r, r + 1))


def square(r, value):
    return [[value(i, j) for i in range(-r, r + 1)] for j in range(-r, r + 1)]


def scaled(kernel):
    up = sum(v for row in kernel for v in row if v > 0)
    down = -sum(v for row in kernel for v in row if v < 0)
    return [[v / up if v > 0 else v / down if v < 0 else 0 for v in row] for row in kernel]


def slow(a, b):
    """Equations of section 4, pixel by pixel."""
    r = math.ceil(3 * math.sqrt(0.04 / (2 * math.pi**2)) * PPD)
    sensitivity = []
    for parts in ([(1, 0.0047)], [(1, 0.0053)], [(34.1, 0.04), (13.5, 0.025)]):
        sensitivity.append(scaled(square(r, lambda i, j: sum(
            s * math.sqrt(math.pi / t) * math.exp(-math.pi**2 * (i * i + j * j) / PPD**2 / t) for s, t in parts))))
    sigma = 0.5 * 0.082 * PPD
    reach = math.ceil(3 * sigma)

    def bell(i, j):
        return math.exp(-(i * i + j * j) / (2 * sigma**2))

    edges = [scaled(square(reach, lambda i, j: -i * bell(i, j))), scaled(square(reach, lambda i, j: -j * bell(i, j)))]
    points = [scaled(square(reach, lambda i, j: (i * i / sigma**2 - 1) * bell(i, j))),
              scaled(square(reach, lambda i, j: (j * j / sigma**2 - 1) * bell(i, j)))]
    rows, columns = len(a), len(a[0])
    seen, strengths = [], []
    for picture in (a, b):
        opponents = [[], [], []]
        for row in picture:
            xyz = [to_xyz(c) for c in row]
            opponents[0].append([116 * c[1] - 16 for c in xyz])
            opponents[1].append([500 * (c[0] - c[1]) for c in xyz])
            opponents[2].append([200 * (c[1] - c[2]) for c in xyz])
        grey = [[(v + 16) / 116 for v in row] for row in opponents[0]]
        labs, features = {}, {}
        for y in range(rows):
            for x in range(columns):
                o = [mean_about(opponents[c], y, x, sensitivity[c], r) for c in range(3)]
                light = (o[0] + 16) / 116
                linear = from_xyz([light + o[1] / 500, light, light - o[2] / 200])
                labs[y, x] = hunt_lab([min(max(v, 0), 1) for v in linear])
                features[y, x] = [math.hypot(*(mean_about(grey, y, x, k, reach) for k in pair))
                                  for pair in (edges, points)]
        seen.append(labs), strengths.append(features)
    most = hyab(hunt_lab([0, 1, 0]), hunt_lab([0, 0, 1]))**0.7
    out = []
    for y in range(rows):
        out.append([])
        for x in range(columns):
            d = hyab(seen[0][y, x], seen[1][y, x])**0.7
            colour = d * 0.95 / (0.4 * most) if d < 0.4 * most else 0.95 + (d - 0.4 * most) / (0.6 * most) * 0.05
            f = max(abs(p - q) for p, q in zip(strengths[0][y, x], strengths[1][y, x]))
            out[-1].append(colour**(1 - (f / math.sqrt(2))**0.5))
    return out


def plain(colour, rows=8, columns=9):
    return np.broadcast_to(np.array(colour, float), (rows, columns, 3))


class Flip(unittest.TestCase):
    def test_same_pictures(self):
        noise = np.random.default_rng(1).random((12, 14, 3))
        self.assertEqual(np.abs(perceptual.difference(noise, noise)).max(), 0)

    def test_symmetric(self):
        rng = np.random.default_rng(2)
        a, b = rng.random((12, 14, 3)), rng.random((12, 14, 3))
        there, back = perceptual.difference(a, b), perceptual.difference(b, a)
        self.assertLess(np.abs(there - back).max(), 1e-12)
        self.assertTrue(0 <= there.min() and there.max() <= 1)

    def test_known_colours(self):
        # Green against blue is the largest difference there is, by definition 1.
        self.assertAlmostEqual(perceptual.difference(plain([0, 1, 0]), plain([0, 0, 1])).mean(), 1, 9)
        # CIELAB under D65 as it is printed everywhere, to two decimals.
        lab = {(1, 1, 1): (100, 0, 0), (0, 0, 0): (0, 0, 0), (1, 0, 0): (53.24, 80.09, 67.20),
               (0, 1, 0): (87.73, -86.18, 83.18), (0, 0, 1): (32.30, 79.19, -107.86)}
        hunt = {c: (l, 0.01 * l * a, 0.01 * l * b) for c, (l, a, b) in lab.items()}
        most = hyab(hunt[0, 1, 0], hunt[0, 0, 1])**0.7
        for one, other in (((1, 1, 1), (0, 0, 0)), ((1, 0, 0), (0, 0, 0)), ((1, 0, 0), (0, 1, 0))):
            d = hyab(hunt[one], hunt[other])**0.7 / most
            wanted = 0.95 * d / 0.4 if d < 0.4 else 0.95 + 0.05 * (d - 0.4) / 0.6
            self.assertAlmostEqual(perceptual.difference(plain(one), plain(other)).mean(), wanted, 3)

    def test_against_loops(self):
        numbers = random.Random(3)
        a = [[[numbers.random() for _ in range(3)] for _ in range(7)] for _ in range(6)]
        b = [[[min(max(v + numbers.uniform(-0.2, 0.2), 0), 1) for v in c] for c in row] for row in a]
        found = perceptual.difference(np.array(a), np.array(b))
        # Rounding alone, which a power of 0.7 near 0 does not spread far.
        self.assertLess(np.abs(found - np.array(slow(a, b))).max(), 1e-9)

    def test_a_single_pixel(self):
        dark, dot = np.zeros((9, 9, 3)), np.zeros((9, 9, 3))
        dot[4, 4] = 1
        found = perceptual.difference(dark, dot)
        self.assertLess(np.abs(found - np.array(slow(dark.tolist(), dot.tolist()))).max(), 1e-6)
        self.assertEqual(found.argmax(), 4 * 9 + 4)
        self.assertLess(np.abs(found - found.T).max(), 1e-12)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
