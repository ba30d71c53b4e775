"""What the checkers share: which files there are, C++ text without comments and literals, findings."""

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

CPP = (".cpp", ".hpp")
# Known-bad trees that prove the checkers fire; they break every rule on purpose.
FIXTURES = "tests/fixtures/"
# What building leaves behind, as .gitignore names it; for trees that are not a checkout.
MADE = ("build/", ".venv/", ".venv-bench/", ".venv-check/", "install/", "log/")


@dataclass(frozen=True, order=True)
class Finding:
    file: str
    line: int
    message: str

    def __str__(self):
        return f"{self.file}:{self.line}: {self.message}"


def files(root: Path) -> list[str]:
    """Paths under root as git would commit them (all, where root is not a checkout), fixtures left out, sorted."""
    if (root / ".git").exists():
        listed = subprocess.run(
            ["git", "-c", f"safe.directory={root}", "-C", str(root), "ls-files", "-z", "--cached", "--others",
             "--exclude-standard"], check=True, capture_output=True, text=True).stdout.split("\0")
        found = {name for name in listed if name and (root / name).is_file()}
    else:
        found = {str(path.relative_to(root)) for path in root.rglob("*") if path.is_file()}
        found = {name for name in found if not name.startswith(MADE)}
    return sorted(name for name in found if not name.startswith(FIXTURES))


def read(root: Path, name: str) -> str:
    return (root / name).read_text(encoding="utf-8", errors="replace")


TOKEN = re.compile(
    r'//[^\n]*(?:\\\n[^\n]*)*'  # line comment
    r'|/\*.*?\*/'  # block comment
    r'|R"(?P<tag>[^()\\\s]{0,16})\(.*?\)(?P=tag)"'  # raw string
    r'|"(?:\\.|[^"\\\n])*"'  # string
    r"|(?<![0-9A-Fa-f])'(?:\\.|[^'\\\n])+'",  # character, not a digit separator
    re.DOTALL)


def without_comments(text: str, keep_strings: bool = False) -> str:
    """C++ text of the same lines, its comments blank and (unless kept) its literals empty."""

    def blank(match):
        token = match.group(0)
        if token[0] == "/":
            return " " + "\n" * token.count("\n")
        if keep_strings:
            return token
        return '""' + "\n" * token.count("\n")

    return TOKEN.sub(blank, text)


def report(name: str, findings: list[Finding], checked: int) -> int:
    """Prints findings, or that there are none; the exit code."""
    for finding in sorted(findings):
        print(finding)
    if findings:
        print(f"{name}: {len(findings)} finding(s) in {checked} files")
        return 1
    print(f"{name}: {checked} files, nothing found")
    return 0
