#!/usr/bin/env python3
"""Whether a flood on the ROS 2 domain reaches the control loop: runs of a world in real time as a node, one quiet and
one beside a peer (tests/ros/hostile_peer) that writes small messages to all topics and services that the run takes, but
those that stop it, as fast as it goes, turn by turn. Compares how late the loop's ticks begin and how long its steps
and the bridge's ticks take.

The peer is kept off the loop's CPU, as other programs of a robot's computer are (docs/real_time.md, packaging/).
What it takes of the other CPUs the run lacks, flood or not: --burner puts a program of the same appetite, which sends
nothing, beside the quiet runs.

usage: bench/ros_flood.py [--gate] [--pairs N (5)] [--parcels N (3)] [--world W (parcel_cell)] [--burner]
--gate: exit code 1 where a median of the ratios is above its bar, or a run fails."""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

BUILD = Path(__file__).resolve().parent.parent / "build/release"
# What is compared, of the report; the bar of the ratios' median. The rest is told, not judged.
FIGURES = {("loop", "late_p50_us"): 1.1, ("loop", "late_p99_us"): 1.1, ("loop", "p50_us"): 1.1, ("loop", "p99_us"): 1.1,
           ("loop", "late_max_us"): None, ("loop", "missed"): None, ("bridge", "p99_ms"): None,
           ("bridge", "max_ms"): None}


def others_cpus():
    """All but the last, which the loop takes; of a single CPU that one."""
    cpus = sorted(os.sched_getaffinity(0))
    return set(cpus[:-1]) or set(cpus)


class Beside:
    """A program that is kept off the loop's CPU and ends when its input does."""

    def __init__(self, command):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                                        preexec_fn=lambda: os.sched_setaffinity(0, others_cpus()))

    def end(self):
        out, _ = self.process.communicate()
        return out


def one_run(options, domain, beside):
    with tempfile.TemporaryDirectory(dir=options.folder) as folder:
        report = Path(folder) / "report.json"
        company = Beside(beside) if beside else None
        pons = [options.pons, "run", options.world, "--realtime", "--parcels", str(options.parcels), "--seed", "1",
                "--quiet", "--ros", "--ros-domain", str(domain), "--report", str(report),
                "--journal", str(Path(folder) / "j.db")]
        done = subprocess.run(pons, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
        said = company.end() if company else ""
        if done.returncode != 0 or not report.exists():
            sys.exit(f"ros_flood: the run ended with {done.returncode}: {done.stderr.strip()[-1000:]}")
        if beside and beside[0] == options.peer and "sent to rq/pons/submit_taskRequest" not in said:
            sys.exit("ros_flood: the flood did not reach the run: " + said)
        return json.loads(report.read_text())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gate", action="store_true")
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--parcels", type=int, default=3)
    parser.add_argument("--world", default="parcel_cell")
    parser.add_argument("--burner", action="store_true")
    parser.add_argument("--folder", help="where journals lie (that of temporary files)")
    parser.add_argument("--domain", type=int, default=15)
    parser.add_argument("--pons", default=str(BUILD / "apps/pons"))
    parser.add_argument("--peer", default=str(BUILD / "tests/ros/hostile_peer"))
    options = parser.parse_args()
    flood = [options.peer, str(options.domain), "hostile", "flood"]
    burner = [sys.executable, "-c", "import select, sys\nwhile not select.select([sys.stdin], [], [], 0)[0]: pass"]
    ratios = {figure: [] for figure in FIGURES}
    for pair in range(options.pairs):
        quiet = one_run(options, options.domain, burner if options.burner else None)
        flooded = one_run(options, options.domain, flood)
        for part, name in FIGURES:
            before, after = quiet[part][name], flooded[part][name]
            ratios[part, name].append(after / before if before else float(after > 0) + 1)
            print(f"{pair + 1}  {part} {name:<12} quiet {before:10.2f}  flooded {after:10.2f}")
        for way, report in (("quiet", quiet), ("flooded", flooded)):
            wrong = {part: each["why"] for part, each in report["health"]["parts"].items() if each["alerts"]}
            print(f"{pair + 1}  {way}: degraded '{report['loop']['degraded']}', findings {len(report['findings'])}, "
                  f"alerts {wrong}")
        sys.stdout.flush()
    missed = False
    for (part, name), bar in FIGURES.items():
        ratio = statistics.median(ratios[part, name])
        beyond = bar is not None and ratio > bar
        missed = missed or beyond
        print(f"{part} {name:<12} median ratio {ratio:.2f}" + (f" (bar {bar})" if bar else "") +
              (" MISSED" if beyond else ""))
    return 1 if options.gate and missed else 0


if __name__ == "__main__":
    sys.exit(main())
