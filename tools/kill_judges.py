"""What tools/kill_processes holds against what a killed process leaves: a sender who remembers what it was told, the
journal as the next process will find it, the loop's log of its stops, the body's report, the ground of a worker."""

import collections
import json
import random
import re
import shutil
import socket
import sqlite3
import subprocess
import tempfile
from pathlib import Path

LEASH_MS = 105  # a tick or two later the silence is noticed
BRAKING_MS = 300
SILENCE = re.compile(r"no command for ([0-9.]+) ms")
STANDSTILL = re.compile(r"standstill (\w+) (\d+) ms after the stop began, (\d+) of them braking")
ANSWERS_WITHIN_S = 2.0


def ask(path: Path, request: dict, before_answer=None) -> dict | None:
    """One line to the socket at `path` and one back; None where nobody answers, as of a process that was killed.
    `before_answer` is called when the request has been sent."""
    try:
        with socket.socket(socket.AF_UNIX) as line:
            line.settimeout(ANSWERS_WITHIN_S)
            line.connect(str(path))
            line.sendall(json.dumps(request).encode() + b"\n")
            if before_answer:
                before_answer()
            text = b""
            while not text.endswith(b"\n"):
                part = line.recv(65536)
                if not part:
                    return None
                text += part
            return json.loads(text)
    except OSError:
        return None


class Sender:
    """Asks for tasks over the socket, again when it was not answered, and again when it was: as a warehouse does that
    has forgotten. Remembers all that it was told; any kill may come before or after an answer."""

    def __init__(self, path: Path, chance: random.Random, steps, most: int):
        self.path, self.chance, self.steps, self.most = path, chance, steps, most
        self.asked: list[str] = []  # in the order of asking
        self.told: dict[str, str] = {}  # id: its first answer, "new" or "already"
        self.outcomes: dict[str, str] = {}
        self.repeats = self.refused = 0
        self.problems: list[str] = []

    def submit(self, before_answer=None) -> bool:
        """One more, or one that it has asked for before; whether it was answered."""
        again = self.asked and (len(self.asked) >= self.most or self.chance.random() < 0.4)
        task = self.chance.choice(self.asked[-8:]) if again else f"kill-{len(self.asked) + 1}"

        def sent():
            if task not in self.asked:
                self.asked.append(task)
            if before_answer:
                before_answer()

        request = {"op": "submit", "task": {"id": task, "priority": sum(task.encode()) % 101 // 2, "steps": self.steps(task)}}
        answer = ask(self.path, request, sent)
        if answer is None:
            return False
        if not answer.get("ok"):
            self.refused += 1
            if task in self.told:
                self.problems.append(f"{task} was accepted and is refused afterwards: {answer}")
            return True
        if task in self.told:
            self.repeats += 1
            if answer["accepted"] != "already":
                self.problems.append(f"{task} was accepted twice")
        self.told.setdefault(task, answer["accepted"])
        return True

    def look(self):
        """Which tasks have ended, as the bridge tells."""
        answer = ask(self.path, {"op": "list", "which": "ended", "limit": 20})
        for task in (answer or {}).get("tasks", []):
            before = self.outcomes.setdefault(task["id"], task["outcome"])
            if before != task["outcome"]:
                self.problems.append(f"{task['id']} ended as {before} and then as {task['outcome']}")


class Left:
    """A killed process's journal, copied before the next process opens it."""

    def __init__(self, journal: Path):
        self.folder = tempfile.TemporaryDirectory(prefix="kill_processes.copy.")
        self.file = Path(self.folder.name) / journal.name
        for name in (journal.name, journal.name + "-wal"):
            if (journal.parent / name).is_file():
                shutil.copy(journal.parent / name, self.file.parent / name)

    def close(self):
        self.folder.cleanup()


def is_begun(file: Path) -> bool:
    """Whether it holds more than nothing: a process may be killed before it has laid a journal out, and the next one does."""
    if not file.is_file():
        return False
    database = sqlite3.connect(file)
    try:
        return database.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0] > 0
    except sqlite3.Error:
        return True  # whatever it is, it is to be looked at
    finally:
        database.close()


def check(pons: Path, file: Path) -> list[str]:
    """Each task's story: one acceptance, one outcome, no step done twice."""
    checked = subprocess.run([pons, "journal", "check", file], capture_output=True, text=True)
    return [f"the journal is not whole: {checked.stderr.strip()}"] if checked.returncode else []


def held_against(file: Path, sender: Sender, begun: collections.Counter) -> list[str]:
    """What was told and is not so; `begun`: how often each "TASK STEP" was begun in truth."""
    wrong = []
    database = sqlite3.connect(file)
    try:
        rows = database.execute("SELECT task, kind, detail FROM event WHERE kind IN ('accepted', 'ended', 'attempt')").fetchall()
    except sqlite3.Error as error:
        return [f"the journal cannot be read: {error}"]
    finally:
        database.close()
    accepted = {task for task, kind, _ in rows if kind == "accepted"}
    ended = {task: json.loads(detail)["outcome"] for task, kind, detail in rows if kind == "ended"}
    attempts = collections.Counter(f"{task} {json.loads(detail)['step']}" for task, kind, detail in rows if kind == "attempt")
    wrong += [f"{task} was accepted and is lost" for task in sender.told if task not in accepted]
    wrong += [f"{task} ended as {outcome} and did not" for task, outcome in sender.outcomes.items() if ended.get(task) != outcome]
    wrong += [f"{step} was begun {times} times, and the journal knows {attempts[step]}" for step, times in begun.items()
              if times > attempts[step]]
    return wrong


def without_outcome(file: Path, sender: Sender) -> list[str]:
    database = sqlite3.connect(file)
    ended = {row[0] for row in database.execute("SELECT task FROM event WHERE kind = 'ended'")}
    database.close()
    return [f"{task} was accepted and has no outcome" for task in sender.told if task not in ended]


def ground(file: Path) -> tuple[collections.Counter, collections.Counter]:
    """How often each "TASK STEP" was begun, and done, in truth."""
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    parts = {"begun": collections.Counter(), "done": collections.Counter()}
    for line in lines:
        what, step = line.split(" ", 1)
        parts[what][step.rstrip()] += 1
    return parts["begun"], parts["done"]


class Stops:
    """What the loops wrote of the stops after their bridges were killed."""

    def __init__(self):
        self.silence_ms, self.standstill_ms, self.braking_ms = [], [], []

    def take(self, log: str, body_was_killed: bool) -> list[str]:
        problems = []
        stops = log.split("protective stop: heartbeat lost")[1:]
        for number, stop in enumerate(stops, 1):
            silence, standstill = SILENCE.search(stop), STANDSTILL.search(stop)
            if not silence or not standstill:
                if not (body_was_killed and number == len(stops)):
                    problems.append(f"a stop without silence or standstill: {stop[:200]}")
                continue
            result, took, braking = standstill.groups()
            self.silence_ms.append(float(silence.group(1)))
            self.standstill_ms.append(int(took))
            self.braking_ms.append(int(braking))
            # What swings on the cups, or rides on below them, moves an arm that has braked for a while yet; confirmed is
            # what stood within 2 s.
            if result != "CONFIRMED" or self.silence_ms[-1] > LEASH_MS or int(braking) > BRAKING_MS:
                problems.append(f"stopped too late: {silence.group(0)}, {standstill.group(0)}")
        return problems

    def add(self, others: "Stops"):
        self.silence_ms += others.silence_ms
        self.standstill_ms += others.standstill_ms
        self.braking_ms += others.braking_ms

    def worst(self) -> dict:
        return {"stops": len(self.silence_ms), "silence_ms": max(self.silence_ms, default=None),
                "braking_ms": max(self.braking_ms, default=None), "standstill_ms": max(self.standstill_ms, default=None)}


def of_report(file: Path, said: str, sums: collections.Counter) -> list[str]:
    """What the referee has found wrong; `sums` gains its counts."""
    if not file.is_file():
        return [f"no report: {said}"]
    report = json.loads(file.read_text(encoding="utf-8"))
    parcels, problems = report["parcels"], []
    for what in ("offered", "sorted", "lost", "missorted", "duplicated"):
        sums[what] += parcels[what]
    for what in ("deserved", "undeserved"):
        sums[f"{what} exceptions"] += parcels["exceptions"][what]
    sums["limit violations"] += report["limits"]["violations"]
    for what in ("lost", "missorted", "duplicated"):
        if parcels[what]:
            problems.append("; ".join([f"{what} {parcels[what]}", *report["findings"]]))
    if report["limits"]["violations"]:
        problems.append(f"{report['limits']['violations']} limit violations, {report['limits']['worst_ratio']:.3f} of a limit")
    return problems
