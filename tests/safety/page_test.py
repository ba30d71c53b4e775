#!/usr/bin/env python3
"""docs/safety.md shows the safety machine's tables as the program prints them.

usage: page_test.py SAFETY_TABLES PAGE [--write]     --write puts them in; exit code 1: the page differs"""

import subprocess
import sys
from pathlib import Path

BEGIN = "<!-- drawn by safety_tables: begin -->\n"
END = "<!-- drawn by safety_tables: end -->"


def main() -> int:
    program, page = sys.argv[1], Path(sys.argv[2])
    printed = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    text = page.read_text(encoding="utf-8")
    before, begin, rest = text.partition(BEGIN)
    shown, end, after = rest.partition(END)
    if not begin or not end or not printed:
        print(f"{page}: the lines that mark the tables are missing, or nothing was printed")
        return 1
    if "--write" in sys.argv[3:]:
        page.write_text(before + BEGIN + printed + END + after, encoding="utf-8")
        return 0
    if shown != printed:
        print(f"{page}: the tables differ from the code; run: {sys.argv[0]} {program} {page} --write")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
