#!/usr/bin/env python3
"""tools/ros_codecs: hashes are those that ROS 2 Jazzy's nodes announce, and what is wrong with an interface file is said."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TOOL, INTERFACES = ROOT / "tools" / "ros_codecs", ROOT / "ros2" / "interfaces"


class Codecs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)

    def file(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def run_tool(self, *arguments):
        return subprocess.run([sys.executable, "-B", str(TOOL), *map(str, arguments)], capture_output=True, text=True)

    def refused(self, name, text):
        self.file(name, text)
        out = self.root / "out"
        done = self.run_tool("--out", out, self.root)
        self.assertEqual(done.returncode, 1, done.stdout)
        self.assertFalse(out.exists(), "nothing is written")
        (self.root / name).unlink()
        return done.stderr

    def test_a_service_and_an_action_have_the_hashes_that_jazzys_example_nodes_announce(self):
        self.file("example_interfaces/srv/AddTwoInts.srv", "int64 a\nint64 b\n---\nint64 sum\n")
        self.file("example_interfaces/action/Fibonacci.action", "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n")
        done = self.run_tool("--hashes", INTERFACES, self.root)
        self.assertEqual(done.returncode, 0, done.stderr)
        found = dict(line.split() for line in done.stdout.splitlines())
        for name, begins in {"srv/AddTwoInts": "e118de6bf5eeb66a2491b5bda11202e7",
                             "action/Fibonacci": "9508051da1ea4658de144b09bd0690ff",
                             "action/Fibonacci_SendGoal": "d1a57fb2a4afe8c21e34fb10db206f16",
                             "action/Fibonacci_GetResult": "1b0de0d5d29dc955d92f546706568428",
                             "action/Fibonacci_FeedbackMessage": "c1de71afd52e49a89c53d82623668841"}.items():
            self.assertTrue(found[f"example_interfaces/{name}"].startswith(f"RIHS01_{begins}"), name)

    def test_what_is_wrong_is_said_with_file_and_line(self):
        for name, text, said in [
                ("a/msg/A.msg", "# a comment\nint33 x\n", "A.msg: no a/msg/int33"),
                ("a/msg/A.msg", "\nint32\n", "A.msg:2: 'int32' is neither a field nor a constant"),
                ("a/msg/A.msg", "int32[0] x\n", "A.msg:1: an array has at least one element"),
                ("a/msg/A.msg", "int32[-1] x\n", "A.msg:1: 'int32[-1]' is no type"),
                ("a/msg/A.msg", "int32<=3 x\n", "A.msg:1: only a string has a bound"),
                ("a/msg/A.msg", "wstring x\n", "A.msg:1: wstring"),
                ("a/msg/A.msg", "uint8 A=many\n", "A.msg:1: 'many' is no uint8"),
                ("a/msg/A.msg", "bool x maybe\n", "A.msg:1: 'maybe' is neither true nor false"),
                ("a/msg/A.msg", "int32[] x 1, 2\n", "A.msg:1: the default of several"),
                ("a/msg/A.msg", "int32 x\nint8 x\n", "a/msg/A has two 'x'"),
                ("a/msg/A.msg", "other/Thing x\n", "A.msg: no other/msg/Thing"),
                ("a/msg/A.srv", "---\n", "A.srv: a .srv file lies in a folder srv/"),
                ("a/msg/A.txt", "int32 x\n", "holds no PACKAGE/msg/NAME.msg"),
                ("a/srv/A.srv", "int32 x\n", "A.srv: a .srv file has 2 parts"),
                ("a/action/A.action", "---\n---\n---\n", "A.action: a .action file has 3 parts")]:
            with self.subTest(name=name, text=text):
                self.assertIn(said, self.refused(name, text))

    def test_what_recordings_keep_is_the_file_or_is_made_of_its_parts(self):
        self.file("a_humble/msg/One.msg", "# as it stands\nint32 x 5\na_humble/Two[<=3] twos\n")
        self.file("a_humble/msg/Two.msg", "string<=4 name\n")
        self.file("a_humble/srv/Ask.srv", 'uint8 A=3\nstring S="b c"\nfloat32[2] f [1.5, 2]\nTwo[] twos\nbool b true\n---\n')
        self.file("builtin_interfaces/msg/Time.msg", "int32 sec\nuint32 nanosec\n")
        self.file("service_msgs/msg/ServiceEventInfo.msg", "builtin_interfaces/Time stamp\n")
        out = self.root / "out"
        done = self.run_tool("--out", out, self.root)
        self.assertEqual(done.returncode, 0, done.stderr)
        text = (out / "pons/wire/types/all_schemas.hpp").read_text()
        self.assertIn('{"a_humble/msg/One", "a/One", R"msg(# as it stands\nint32 x 5\na/Two[<=3] twos\n)msg",\n'
                      '     "a_humble/msg/Two"}', text)
        self.assertIn('R"msg(uint8 A=3\nstring S="b c"\nfloat32[2] f [1.5, 2.0]\na/Two[] twos\nbool b true\n)msg"', text)
        self.assertIn('{"a_humble/srv/Ask_Response", "a/Ask_Response", R"msg()msg",\n     ""}', text)
        self.assertIn('a/Ask_Request[<=1] request\n', text)

    def test_only_what_changed_is_written_and_what_is_no_longer_made_goes(self):
        self.file("a/msg/One.msg", "int32 x\n")
        self.file("a/msg/TwoThree.msg", "One[] ones\nstring<=4 class\n")
        out = self.root / "out"
        self.assertEqual(self.run_tool("--out", out, self.root).returncode, 0)
        one, two = (out / "pons/wire/types/a/msg" / name for name in ("one.hpp", "two_three.hpp"))
        self.assertIn('visit("class", self.class_, AtMost{4});', two.read_text())
        before = one.stat().st_mtime_ns
        (self.root / "a/msg/TwoThree.msg").unlink()
        self.assertEqual(self.run_tool("--out", out, self.root).returncode, 0)
        self.assertEqual(one.stat().st_mtime_ns, before)
        self.assertFalse(two.exists())


if __name__ == "__main__":
    unittest.main()
