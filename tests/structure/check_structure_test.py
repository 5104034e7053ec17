#!/usr/bin/env python3
"""Does check_structure.py find what it is there to find? Small trees, each with one fault."""

import shutil
import sys
import tempfile
import unittest
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
import check_structure  # noqa: E402


class CheckStructure(unittest.TestCase):
    def setUp(self):
        self.root = Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)

    def problems(self, files):
        for name, text in files.items():
            path = self.root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return check_structure.check(self.root)[0]

    def assert_one(self, files, *words):
        problems = self.problems(files)
        self.assertEqual(len(problems), 1, problems)
        for word in words:
            self.assertIn(word, problems[0])

    def test_allowed_edges_are_silent(self):
        self.assertEqual(self.problems({
            "core/image_io.cpp": "#include <OpenImageIO/imageio.h>\n#include <vector>\n",
            "wavelet/haar.cpp": '#include "core/rgb.h"\n#include "wavelet/haar.h"\n',
            "prt/transport.h": '#include <Eigen/Dense>\n#include "wavelet/haar.h"\n',
            "precompute/rays.cpp": '#include <embree3/rtcore.h>\n#include "prt/transport.h"\n',
            "tests/core/a.cpp": '#include <gtest/gtest.h>\n#include "apps/verbs.h"\n',
            "bench/rays.cpp": '#include <embree3/rtcore.h>\n#include <benchmark/benchmark.h>\n',
            "CMakeLists.txt": "# -ffast-math is forbidden\nadd_compile_options(-O3)\n",
        }), [])

    def test_an_upward_edge_is_found(self):
        self.assert_one({"core/a.h": '#include "wavelet/haar.h"\n'}, "core/a.h:1", "wavelet/haar.h")

    def test_every_edge_that_the_table_lacks_is_found(self):
        for folder, uses in check_structure.USES.items():
            for target in check_structure.EVERY - uses - {folder}:
                name = f"{folder}/a.h"
                self.assert_one({name: f'// One.\n#  include  "{target}/b.h"\n'}, f"{name}:2", target)
            shutil.rmtree(self.root / folder, ignore_errors=True)

    def test_a_relative_include_is_found(self):
        self.assert_one({"core/a.cpp": '#include "rgb.h"\n'}, "rgb.h")
        self.assert_one({"core/a.cpp": '#include "../wavelet/haar.h"\n'}, "../wavelet/haar.h")

    def test_own_headers_in_angle_brackets_are_found(self):
        self.assert_one({"core/rgb.h": "", "wavelet/a.cpp": "#include <core/rgb.h>\n"}, "quotes")

    def test_third_party_headers_out_of_place_are_found(self):
        for number, (name, header) in enumerate([
            ("wavelet/a.cpp", "OpenImageIO/imageio.h"), ("core/atomic.cpp", "OpenImageIO/imageio.h"),
            ("prt/a.cpp", "OpenEXR/ImfHeader.h"), ("prt/a.cpp", "embree3/rtcore.h"),
            ("apps/a.cpp", "embree4/rtcore.h"), ("data_gen/a.cpp", "assimp/scene.h"),
            ("apps/a.cpp", "GLFW/glfw3.h"), ("prt/a.cpp", "CLI/CLI.hpp"),
            ("core/a.cpp", "gtest/gtest.h"), ("apps/a.cpp", "benchmark/benchmark.h"),
        ]):
            with self.subTest(number=number, header=header):
                self.assert_one({name: f"#include <{header}>\n"}, name, header)
                (self.root / name).unlink()

    def test_an_unknown_folder_is_found(self):
        self.assert_one({"stuff/a.h": ""}, "stuff")

    def test_fast_math_is_found(self):
        for name in ("CMakeLists.txt", "core/CMakeLists.txt", "cmake/flags.cmake", "build_it.sh"):
            for flag in ("-ffast-math", "-Ofast"):
                with self.subTest(name=name, flag=flag):
                    self.assert_one({name: f"set(F {flag})\n"}, name, "fast-math")
                    (self.root / name).unlink()

    def test_wrong_formatting_is_found(self):
        if check_structure.clang_format_14() is None:
            # Then nothing is checked, and nothing may be claimed.
            self.assertEqual(self.problems({"core/a.h": "int  a ;\n", ".clang-format": ""}), [])
            return
        self.assert_one({".clang-format": "BasedOnStyle: Google\n", "core/a.h": "int  a ;\n",
                         "core/b.h": "int b;\n"}, "core/a.h", ".clang-format")

    def test_build_folders_are_left_alone(self):
        self.assertEqual(self.problems({
            "build/x/a.h": '#include "nothing.h"\n', "build-2/CMakeLists.txt": "-ffast-math\n",
            "out/demo/a.h": '#include "nothing.h"\n'}), [])


if __name__ == "__main__":
    unittest.main()
