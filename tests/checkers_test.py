#!/usr/bin/env python3
"""Known-bad trees: tools/check_layers and tools/check_style must name the file and line, and pass a good one."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TOOLS = Path(__file__).resolve().parent.parent / "tools"
LAYERS = """set(PONS_MAY_USE_core "")
set(PONS_MAY_USE_sim core)
set(PONS_MAY_USE_rt core)
set(PONS_MAY_USE_bridge core)
set(PONS_MAY_USE_referee sim bridge core)
set(PONS_ONLY_referee pons/sim/truth.hpp pons/bridge/journal)
"""
GOOD = {
    "cmake/Layers.cmake": LAYERS,
    "pons/core/CMakeLists.txt": "pons_module(core)\n",
    "pons/core/time.hpp": "#pragma once\n#include <chrono>\n",
    "pons/sim/CMakeLists.txt": "pons_module(sim\n  SOURCES sim.cpp\n  USES core)\n",
    "pons/sim/truth.hpp": '// Only the referee sees it.\n#pragma once\n#include "pons/core/time.hpp"\n',
    "pons/sim/sim.cpp": '#include <mujoco/mujoco.h>\n#include "pons/sim/truth.hpp"\n// std::thread is not used\n',
    "pons/rt/CMakeLists.txt": "pons_module(rt SOURCES loop.cpp)\n",
    "pons/rt/loop.cpp": "#include <thread>\nvoid f() { std::jthread t; }\n",
    "pons/referee/CMakeLists.txt": "pons_module(referee USES sim bridge)\n",
    "pons/referee/referee.hpp": '#pragma once\n#include "pons/sim/truth.hpp"\n#include "pons/bridge/journal.hpp"\n',
    "pons/bridge/CMakeLists.txt": "pons_module(bridge USES core)\n",
    "pons/bridge/journal.hpp": '#pragma once\n#include "pons/core/time.hpp"\n',
    "apps/main.cpp": '#include "pons/sim/truth.hpp"\nint main() { return 0; }\n',
}
LONG_BODY = "\n".join(["  ++x;"] * 70)


def check(tool, changes):
    """Exit code and output of a checker on the good tree with some files changed; None takes a file away."""
    with tempfile.TemporaryDirectory() as folder:
        for name, text in {**GOOD, **changes}.items():
            if text is None:
                continue
            path = Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text.replace("@ROOT@", str(Path(folder).resolve())), encoding="utf-8")
        done = subprocess.run([sys.executable, "-B", str(TOOLS / tool), "--root", folder], capture_output=True,
                              text=True, check=False)
        return done.returncode, done.stdout + done.stderr


class Checkers(unittest.TestCase):
    def passes(self, tool, changes):
        code, output = check(tool, changes)
        self.assertEqual(code, 0, output)

    def fires(self, tool, changes, *expected):
        code, output = check(tool, changes)
        self.assertEqual(code, 1, output)
        for text in expected:
            self.assertIn(text, output)


class Layers(Checkers):
    def layers(self, changes, *expected):
        self.fires("check_layers", changes, *expected)

    def test_good_tree(self):
        self.passes("check_layers", {})

    def test_include_the_table_forbids(self):
        for include in ('#include "pons/sim/body.hpp"', "#  include <pons/sim/body.hpp>"):
            self.layers({"pons/rt/clock.hpp": f"#pragma once\n\n{include}\n"},
                        "pons/rt/clock.hpp:3: pons/rt may not include pons/sim")

    def test_include_in_a_comment_does_not_count(self):
        self.passes("check_layers", {"pons/rt/clock.hpp": '#pragma once\n/*\n#include "pons/sim/body.hpp"\n*/\n'})

    def test_ways_round_the_table(self):
        self.layers({"pons/rt/clock.hpp": '#pragma once\n#include "../sim/body.hpp"\n'}, "pons/rt/clock.hpp:2:")
        self.layers({"pons/rt/clock.hpp": '#pragma once\n#include "pons/rt/../sim/body.hpp"\n'}, "no .. in an include")
        self.layers({"pons/rt/clock.hpp": "#pragma once\n#include HEADER\n"}, "name a header, not a macro")

    def test_truth(self):
        bridge = '#pragma once\n#include "pons/core/time.hpp"\n#include "pons/sim/truth.hpp"\n'
        self.layers({"pons/bridge/bridge.hpp": bridge}, "pons/bridge/bridge.hpp:3: only pons/sim, pons/referee")

    def test_referee_sees_only_truth_and_journal(self):
        referee = GOOD["pons/referee/referee.hpp"]
        self.layers({"pons/referee/referee.hpp": referee + '#include "pons/sim/simulation.hpp"\n'},
                    "pons/referee/referee.hpp:4: of pons/sim, pons/referee may include only pons/sim/truth.hpp")
        self.layers({"pons/referee/referee.hpp": referee + '#include "pons/bridge/bridge.hpp"\n'},
                    "pons/referee/referee.hpp:4: of pons/bridge, pons/referee may include only pons/bridge/journal")

    def test_mujoco(self):
        self.layers({"apps/main.cpp": "#include <mujoco/mujoco.h>\n"}, "apps/main.cpp:1: only pons/sim and bench")

    def test_core_depends_on_nothing_else(self):
        self.layers({"pons/core/text.hpp": "#pragma once\n#include <fmt/format.h>\n"}, "pons/core/text.hpp:2:")

    def test_time(self):
        for text in ("std::chrono::steady_clock::now();", "clock_gettime(0, &t);", "time(nullptr);",
                     "std::this_thread::sleep_for(d);", "usleep(3);", "std::thread t;", "std::async(f);"):
            self.layers({"pons/bridge/bridge.hpp": f"#pragma once\nvoid f() {{\n  {text}\n}}\n"},
                        "pons/bridge/bridge.hpp:3:")
        self.passes("check_layers", {"pons/bridge/bridge.hpp": '#pragma once\nauto s = "std::thread"; int runtime(int);\n'})

    def test_the_bridge_knows_no_world(self):
        for text in ("if (world.base) return;", "int parcels = 0;", "double f(const world::Belt& b);"):
            self.layers({"pons/bridge/bridge.hpp": f"#pragma once\n{text}\n"}, "pons/bridge/bridge.hpp:2:")
        self.passes("check_layers", {"pons/bridge/bridge.hpp": '#pragma once\n// a parcel\nauto r = world.resources;\n'})

    def test_tests_start_threads_but_read_no_clock(self):
        self.passes("check_layers", {"pons/sim/CMakeLists.txt": "pons_module(sim SOURCES sim.cpp TESTS a_test.cpp USES core)",
                                     "pons/sim/a_test.cpp": "std::jthread t;\n"})
        self.layers({"pons/sim/a_test.cpp": "\nauto t = steady_clock::now();\n"}, "pons/sim/a_test.cpp:2: steady_clock")

    def test_pons_does_not_include_apps(self):
        self.passes("check_layers", {"apps/main.cpp": '#include "apps/a.hpp"\n', "apps/a.hpp": "#pragma once\n"})
        self.layers({"pons/rt/clock.hpp": '#pragma once\n#include "apps/a.hpp"\n'}, "pons/rt/clock.hpp:2: pons/ may not")

    def test_no_sleep_in_tests(self):
        for name in ("tests/end_to_end_test.cpp", "pons/rt/loop_test.cpp"):
            self.layers({name: "void f() { usleep(1); }\n"}, f"{name}:1: usleep(: no sleep in tests")

    def test_circles(self):
        self.layers({"cmake/Layers.cmake": LAYERS.replace('_core "")', "_core referee)")}, "modules in a circle: ")
        self.layers({"pons/core/a.hpp": '#pragma once\n#include "pons/core/b.hpp"\n',
                     "pons/core/b.hpp": '#pragma once\n#include "pons/core/a.hpp"\n'},
                    "in a circle: pons/core/a.hpp -> pons/core/b.hpp -> pons/core/a.hpp")

    def test_uses_says_what_is_included(self):
        self.layers({"pons/sim/CMakeLists.txt": "pons_module(sim SOURCES sim.cpp)\n"},
                    "pons/sim/CMakeLists.txt:1: USES lacks core")
        self.layers({"pons/rt/CMakeLists.txt": "\npons_module(rt SOURCES loop.cpp USES core)\n"},
                    "pons/rt/CMakeLists.txt:2: USES names core, which no source includes")

    def test_declarations(self):
        self.layers({"pons/rt/CMakeLists.txt": "pons_module(core SOURCES loop.cpp)\n"}, "declares pons_module(core)")
        self.layers({"pons/rt/CMakeLists.txt": "pons_module(rt)\n"}, "does not name pons/rt/loop.cpp")
        self.layers({"pons/rt/CMakeLists.txt": None}, "pons/rt/CMakeLists.txt:1: is missing")
        self.layers({"pons/extra/a.hpp": "#pragma once\n"}, "pons/extra:1: is not in cmake/Layers.cmake")


class SecondWorld(unittest.TestCase):
    WHEELS = "    /v/cmeel.prefix/include/eigen3/Eigen/Core\n"

    def scan(self, lines):
        """What second_world_headers_test.sh makes of one object compiled from these headers."""
        with tempfile.TemporaryDirectory() as folder:
            ninja = Path(folder, "ninja")
            ninja.write_text(f"#!/bin/sh\ncat <<'END'\n{lines}END\n", encoding="utf-8")
            ninja.chmod(0o755)
            script = Path(__file__).resolve().parent / "second_world_headers_test.sh"
            return subprocess.run([script, ninja, folder], capture_output=True, text=True, check=False)

    def test_headers(self):
        self.assertEqual(self.scan("a.o: #deps 1, deps mtime 1 (VALID)\n" + self.WHEELS).returncode, 0)
        for header in ("/usr/include/boost/version.hpp", "/usr/include/eigen3/Eigen/Core", "/usr/include/tinyxml2.h"):
            done = self.scan(f"a.o: #deps 2, deps mtime 1 (VALID)\n    {header}\n{self.WHEELS}")
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"a.o: {header}", done.stdout)

    def test_nothing_compiled_is_no_proof(self):
        self.assertEqual(self.scan("").returncode, 1)
        self.assertEqual(self.scan("a.o: #deps 1, deps mtime 1 (VALID)\n    a.cpp\n").returncode, 1)


class Style(Checkers):
    def style(self, changes, *expected):
        self.fires("check_style", changes, *expected)

    def test_good_tree(self):
        self.passes("check_style", {})

    def test_dead_link(self):
        there = {"docs/a.md": "[b](b.md#part) [c](../README.md) [d](https://e.org/x)\n```\nf[](int)\n```\n",
                 "docs/b.md": "# B\n", "README.md": "# P\n"}
        self.passes("check_style", there)
        self.style(there | {"docs/a.md": "# A\n\n[b](c.md)\n"}, "docs/a.md:3: links to c.md, which is not there")

    def test_long_file(self):
        self.passes("check_style", {"apps/a.cpp": "int a;\n" * 500})
        self.style({"apps/a.cpp": "int a;\n" * 501}, "apps/a.cpp:501: 501 lines")

    def test_long_functions(self):
        for head in ("int f(int x) {", "TEST(A, B) {", "namespace n {\nvoid C::f(int x) const noexcept {",
                     "struct S {\nS() : a_{1}, b_(2), c_{} {", "template <class T>\nvoid f(T x) {",
                     "struct S {\nbool operator()(int x) {"):
            close = "}\n}\n" if head.startswith(("namespace", "struct")) else "}\n"
            line = head.count("\n") + 1
            self.style({"apps/a.cpp": f"{head}\n{LONG_BODY}\n{close}"}, f"apps/a.cpp:{line}: a function of 72 lines")
        self.passes("check_style", {"apps/a.cpp": f"void f() {{\n{LONG_BODY[:-14]}\n}}\n"})
        self.passes("check_style", {"apps/a.cpp": "namespace n {\nint a[] = {\n" + "1,\n" * 100 + "};\n}\n"})

    def test_long_python_function(self):
        self.style({"tools/a.py": "def f():\n" + "    pass\n" * 71}, "tools/a.py:1: a function of 72 lines")

    def test_pragma_once(self):
        self.style({"pons/core/a.hpp": "#include <array>\n#pragma once\n"}, "pons/core/a.hpp:1: #pragma once")

    def test_unfinished(self):
        for word in ("TO" + "DO", "FIX" + "ME", "HA" + "CK"):
            self.style({"pons/core/a.hpp": f"#pragma once\n// {word}: later\n"}, f"pons/core/a.hpp:2: {word}")

    def test_what_means_nothing_elsewhere(self):
        for text in ("see #" + "12", "iss" + "ue 2", "/ho" + "me/ann/pons", "in @ROOT@/build"):
            self.style({"docs/a.md": f"a\n{text}\n"}, "docs/a.md:2:")
        self.passes("check_style", {"docs/a.md": "# Title\n\ncolour #123abc, share/pons, issue one command\n"})


if __name__ == "__main__":
    unittest.main()
