#!/usr/bin/env python3
"""Holds golden.txt against what other writers of CDR make now: PyPI's rosbags, or npm's.

usage: golden_others.py rosbags
       golden_others.py npm NODE PACKAGES     PACKAGES: where tools/setup --npm puts them. Without them, or without node,
                                              it says so and ends with 77, of which ctest knows that it was skipped.
run by .venv-check's interpreter"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
SKIPPED = 77


def run(*words):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    assert done.returncode == 0, f"{words}: {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


def rosbags():
    golden = (HERE / "golden.txt").read_text(encoding="utf-8").splitlines()
    now = run(sys.executable, "-B", HERE / "golden.py").splitlines()
    wrong = [f"golden  {ours}\nrosbags {theirs}" for ours, theirs in zip(golden, now, strict=True) if ours != theirs]
    assert not wrong, "\n".join(wrong[:5])
    print(f"{len(golden)} types of the same bytes and the same hash")
    return 0


def npm(node, packages):
    if not shutil.which(node) or not Path(packages, "node_modules").is_dir():
        print("skipped: no node in PATH" if not shutil.which(node) else f"skipped: no {packages}; run tools/setup --npm")
        return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        cases = Path(folder, "cases.json")
        run(sys.executable, "-B", HERE / "golden.py", "--json", cases)
        print(run(node, HERE / "golden.mjs", packages, cases), end="")
    return 0


if __name__ == "__main__":
    sys.exit({"rosbags": rosbags, "npm": npm}[sys.argv[1]](*sys.argv[2:]))
