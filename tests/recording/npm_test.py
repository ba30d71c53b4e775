#!/usr/bin/env python3
"""Recordings beside npm's reader (others.mjs): a message of each type, in each compression, and a whole run.

usage: npm_test.py RECORDING_PEER PONS NODE PACKAGES     PACKAGES: where tools/setup --npm puts them. Without them, or
without node, it says so and ends with 77, of which ctest knows that it was skipped."""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SKIPPED = 77
READER = Path(__file__).with_name("others.mjs")
TYPES = 245


def run(*words):
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True)
    assert done.returncode == 0, f"{words}: {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


def main(peer, pons, node, packages):
    if not shutil.which(node) or not Path(packages, "node_modules").is_dir():
        print("skipped: no node in PATH" if not shutil.which(node) else f"skipped: no {packages}; run tools/setup --npm")
        return SKIPPED
    with tempfile.TemporaryDirectory() as folder:
        for compression in ("none", "lz4", "zstd"):
            path = Path(folder, f"{compression}.mcap")
            run(peer, "write", path, compression)
            told = run(node, READER, packages, path)
            print(f"{compression}: {told}", end="")
            assert int(told.split()[0]) >= TYPES, told
        # With texts beyond ASCII: what tasks' events say has ± and °.
        path = Path(folder, "run.mcap")
        run(pons, "run", "small_cell", "--parcels", "1", "--quiet", "--record", path)
        told = run(node, READER, packages, path)
        print(f"run: {told}", end="")
        assert any("°".encode().hex() in line for line in run(peer, "show", path).splitlines())
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
