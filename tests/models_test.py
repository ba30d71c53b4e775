#!/usr/bin/env python3
"""Checks the models of the lock-free parts, and of who gets which resource, way and seat, with spin: each as it is must
hold, and each wrong variant that its own comment names must not. usage: models_test.py [MODEL.pml ...]"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

SOURCES = Path(__file__).resolve().parent.parent / "pons"
VARIANT = re.compile(r"^ \*   ([A-Z_]+) ", re.MULTILINE)


def errors_of(model: Path, variant: str | None) -> tuple[int, str]:
    """How many errors the exhaustive search found, and what it printed."""
    with tempfile.TemporaryDirectory() as folder:
        define = [f"-D{variant}"] if variant else []
        subprocess.run(["spin", *define, "-a", str(model)], cwd=folder, check=True, capture_output=True)
        # What is wrong is found soon: the compiler would take longer than the search.
        optimised = "-O0" if variant else "-O2"
        subprocess.run(["cc", optimised, "-w", "-DSAFETY", "-DNOREDUCE", "-o", "pan", "pan.c"], cwd=folder, check=True)
        said = subprocess.run(["./pan", "-m1000000"], cwd=folder, capture_output=True, text=True, check=False).stdout
    found = re.search(r"errors: (\d+)", said)
    complete = "max search depth too small" not in said and "out of memory" not in said
    if found is None or not complete:
        raise SystemExit(f"{model.name}: the search did not end\n{said}")
    return int(found[1]), said


def main() -> int:
    models = [Path(name).resolve() for name in sys.argv[1:]] or sorted(SOURCES.glob("*/models/*.pml"))
    bad = 0
    for model in models:
        text = model.read_text(encoding="utf-8")
        variants = VARIANT.findall(text)
        used = set(re.findall(r"#\s*ifn?def ([A-Z_]+)", text))
        if not variants or set(variants) != used:
            print(f"{model.name}: its comment names {sorted(variants)}, its text has {sorted(used)}")
            bad += 1
        errors, said = errors_of(model, None)
        states = re.search(r"(\d+) states, stored", said)
        print(f"{model.name}: {errors} errors in {states[1] if states else '?'} states")
        bad += errors != 0
        for variant in variants:
            errors, _ = errors_of(model, variant)
            print(f"  {variant}: {'rejected' if errors else 'NOT REJECTED'}")
            bad += errors == 0
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
