#!/usr/bin/env python3
"""A run as npm's client of Foxglove's protocol sees it (others.mjs).

usage: npm_test.py PONS NODE PACKAGES     PACKAGES: where tools/setup --npm puts them. Without them, or without node, it
says so and ends with 77, of which ctest knows that it was skipped."""

import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

SKIPPED = 77
VIEWER = Path(__file__).with_name("others.mjs")


def where(run):
    """As it says itself."""
    said = []
    for line in run.stderr:
        if found := re.search(r"foxglove: (ws://\S+)", line):
            return found[1]
        said.append(line)
    raise AssertionError("it does not listen:\n" + "".join(said))


def main(pons, node, packages):
    if not shutil.which(node) or not Path(packages, "node_modules").is_dir():
        print("skipped: no node in PATH" if not shutil.which(node) else f"skipped: no {packages}; run tools/setup --npm")
        return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        words = [pons, "run", "small_cell", "--parcels", "100", "--realtime", "--quiet", "--foxglove", "0", "--socket",
                 f"{folder}/s"]
        with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as run:
            try:
                return subprocess.run([node, VIEWER, packages, where(run)]).returncode
            finally:
                run.send_signal(signal.SIGINT)
                run.communicate()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
