"""What tools/kill_processes kills: the whole cell, body and bridge in their processes; and a worker, the bridge with its
journal and its socket alone. Each run has one journal, and a folder in which all of it lies."""

import collections
import random
import signal
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

from kill_judges import Left, Sender, Stops, ask, check, ground, held_against, is_begun, of_report, without_outcome

BODY_GONE = 3
GONE = "the body has gone"
TOLD_WITHIN_S = 1.0  # that the body has gone, beside what the computer kept any process waiting for a CPU,
TOLD_AT_ALL_S = 5.0  # and in any case
PRESSURE = Path("/proc/pressure/cpu")
HANGS_S = 90.0  # until an arm that nobody stops is armed, by the computer's clock, which a simulated body may wait for
LONGEST_S = 600.0  # until all is sorted
LOOK_S = 0.005
A_PERSON = "a person"


def kept_waiting_s() -> float:
    """How long this computer has had more to do than it has CPUs, by the kernel's account; 0 where that keeps none."""
    text = PRESSURE.read_text(encoding="ascii") if PRESSURE.is_file() else ""
    return float(text.split("total=")[1].split()[0]) * 1e-6 if "total=" in text else 0.0


@dataclass
class Found:
    """Of one run, or of many."""

    kills: collections.Counter = field(default_factory=collections.Counter)  # by what was killed, and when
    sums: collections.Counter = field(default_factory=collections.Counter)
    stops: Stops = field(default_factory=Stops)
    told_s: list[float] = field(default_factory=list)  # that a body had gone
    problems: list[str] = field(default_factory=list)


class Run:
    """Processes one after the other on one journal, each killed but the last."""

    WHEN: dict[str, float] = {}  # moments, and how often they are chosen
    NAME = ""  # of what is killed
    VISITS_S = 0.0  # between two words of the sender
    TASKS = 4  # of the sender, a kill
    ANSWERS_S = 0.004  # about, when it is asked for something

    def __init__(self, pons: Path, folder: Path, chance: random.Random, kills: int):
        self.pons, self.folder, self.chance, self.planned, self.found = pons, folder, chance, kills, Found()
        self.journal, self.socket, self.said = folder / "j.db", folder / "s", folder / "processes.log"
        self.process: subprocess.Popen | None = None
        self.visited = 0.0
        self.sender = Sender(self.socket, chance, self.steps, max(4, self.TASKS * kills))

    def steps(self, task: str) -> list[dict]:
        raise NotImplementedError

    def start(self):
        raise NotImplementedError

    def launch(self, *words) -> subprocess.Popen:
        with self.said.open("a", encoding="utf-8") as said:
            return subprocess.Popen([str(word) for word in words], stdin=subprocess.DEVNULL, stdout=said, stderr=said)

    def wrong(self, *what: str):
        self.found.problems += [each for each in what if each not in self.found.problems]

    def alive(self) -> bool:
        return self.process.poll() is None

    def kill(self):
        self.process.send_signal(signal.SIGKILL)

    def visit(self):
        if time.monotonic() - self.visited < self.VISITS_S:
            return
        self.visited = time.monotonic()
        self.sender.look() if self.chance.random() < 0.2 else self.sender.submit()

    def until(self, ready, limit_s: float, what: str = "") -> bool:
        """Looks again and again, and has the sender speak meanwhile. False: the process has ended, or it takes too
        long, which is a problem where `what` says of what."""
        end = time.monotonic() + limit_s
        while self.alive():
            if ready():
                return True
            if time.monotonic() > end:
                if what:
                    self.wrong(f"{what} for {limit_s:.0f} s")
                return False
            self.visit()
            time.sleep(LOOK_S)
        return False

    def hears(self) -> bool:
        return (ask(self.socket, {"op": "list", "limit": 1}) or {}).get("ok", False)

    def pause(self, most_s: float):
        self.until(lambda: False, self.chance.uniform(0.0, most_s))

    def live(self, when: str):
        """Until the moment that was drawn; then it is killed, if it has not ended by itself."""
        raise NotImplementedError

    def kill_while_asking(self):
        def die():
            time.sleep(self.chance.uniform(0.0, self.ANSWERS_S))
            self.kill()

        if not self.sender.submit(before_answer=die):
            self.kill()

    def one_life(self) -> bool:
        """Whether the process was killed, and not ended before."""
        when = self.chance.choices(list(self.WHEN), list(self.WHEN.values()))[0]
        self.start()
        self.live(when)
        if self.alive():
            self.kill()
        if self.process.wait() != -signal.SIGKILL:
            return False
        self.found.kills[f"{self.NAME} {when}"] += 1
        self.look_back()
        return True

    def begun(self) -> collections.Counter:
        return collections.Counter()

    def look_back(self):
        left = Left(self.journal)
        if not is_begun(left.file):
            if self.sender.told or self.begun():
                self.wrong(f"the journal is empty, and {len(self.sender.told)} tasks were told accepted")
        else:
            self.wrong(*check(self.pons, left.file), *held_against(left.file, self.sender, self.begun()))
            self.found.sums["journals looked at after a kill"] += 1
        left.close()

    def end(self):
        """What is true of every run in the end. The sender's tasks have ended, too, unless the run was broken off."""
        self.wrong(*self.sender.problems, *check(self.pons, self.journal))
        self.wrong(*held_against(self.journal, self.sender, self.begun()))
        sums, sender = self.found.sums, self.sender
        sums["tasks asked for"] += len(sender.asked)
        sums["tasks told accepted"] += len(sender.told)
        sums["tasks kept though nobody was told"] += sum(first == "already" for first in sender.told.values())
        sums["repeated and told already accepted"] += sender.repeats
        sums["refused, as too many"] += sender.refused

    def kill_what_is_left(self):
        if self.process and self.alive():
            self.kill()
            self.process.wait()


class Cell(Run):
    """`pons body` and one `pons bridge` after the other."""

    WHEN = {"starting": 0.3, "taking over": 0.25, "asked for something": 0.15, "at work": 0.3}
    NAME = "bridge"
    VISITS_S = 1.0
    TASKS = 1
    ANSWERS_S = 0.012
    START_S = 0.3  # until it answers, on a computer that does nothing else

    def __init__(self, pons, folder, chance, kills, *, world: str, parcels: int, seed: int, link: str, ends: str):
        super().__init__(pons, folder, chance, kills)
        self.link, self.ends = link, ends
        self.common = [world, "--parcels", parcels, "--seed", seed, "--link", link]
        self.report, self.log = folder / "r.json", folder / "body.log"
        self.armed_before = 0
        self.body: subprocess.Popen | None = None

    def steps(self, task):
        return [{"skill": "move_to", "arguments": {"place": "home"}}]

    def text(self, file: Path) -> str:
        return file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""

    def armings(self) -> int:
        return self.text(self.log).count("armed in epoch")

    def start(self):
        self.armed_before = self.armings()
        self.process = self.launch(self.pons, "bridge", *self.common, "--quiet", "--journal", self.journal, "--socket", self.socket,
                                   "--wait", "60")

    def live(self, when):
        if when == "starting":
            self.pause(self.START_S)
            return
        if not self.until(self.hears, HANGS_S, "a bridge has not answered"):
            return
        if when == "taking over":
            self.pause(2.0)
        elif when == "asked for something":
            self.pause(1.0)
            self.kill_while_asking()
        elif self.until(lambda: self.armings() > self.armed_before, HANGS_S, "the arm is not armed"):
            self.pause(5.0)

    def run(self):
        self.body = self.launch(self.pons, "body", *self.common, "--report", self.report, "--log", self.log, "--explain")
        done = 0
        while done < self.planned and self.one_life() and not self.found.problems:
            done += 1
            # The next one may come before the loop has missed the last.
            time.sleep(self.chance.choice((0.0, 0.0, 0.05, 0.2, 0.5)))
        killed = self.ends == "body" and self.body.poll() is None
        if killed:
            self.kill_body()
        else:
            self.finish()
        self.wrong(*self.found.stops.take(self.text(self.log), killed))
        self.end()
        left = [path.name for path in Path("/dev/shm").glob(f"pons.{self.link}*")]
        if left and not killed:  # the next body clears away what a killed one left
            self.wrong(f"left in shared memory: {left}")

    def finish(self):
        """The last bridge may end, and with it the body."""
        code = self.process.returncode
        if self.body.poll() is None and code == -signal.SIGKILL:
            self.start()
            last_look = [0.0]

            def ended():
                if time.monotonic() - last_look[0] > 1:
                    last_look[0] = time.monotonic()
                    robot = (ask(self.socket, {"op": "robot"}) or {}).get("robot", {})
                    if robot.get("needs", "").startswith(A_PERSON):
                        self.wrong(f"the arm needs {robot['needs']}: {robot}")
                return bool(self.found.problems)

            self.until(ended, LONGEST_S, "the last bridge goes on")
            code = self.end_process(self.process, "the last bridge")
        if code != 0:
            self.wrong(f"the last bridge ended with {code}")
        if self.found.problems and self.body.poll() is None:
            self.body.send_signal(signal.SIGINT)
        self.end_process(self.body, "the body")
        self.wrong(*of_report(self.report, self.text(self.said)[-2000:], self.found.sums))
        if not self.found.problems:
            self.wrong(*without_outcome(self.journal, self.sender))

    def end_process(self, process: subprocess.Popen, what: str) -> int:
        if self.found.problems and process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            return process.wait(timeout=60)
        except subprocess.TimeoutExpired:
            self.wrong(f"{what} hangs")
            process.kill()
            return process.wait()

    def kill_body(self):
        """While a bridge is at work; it says so, and closes its journal."""
        self.start()
        if not self.until(self.hears, HANGS_S, "a bridge has not answered"):
            return
        self.pause(6.0)
        said = len(self.text(self.said))
        if not self.alive():
            return
        waited_s = kept_waiting_s()
        self.body.kill()
        killed = time.monotonic()
        self.found.kills["body"] += 1
        while GONE not in self.text(self.said)[said:] and time.monotonic() < killed + 30:
            time.sleep(LOOK_S)
        took_s = time.monotonic() - killed
        self.found.told_s.append(took_s)
        waited_s = kept_waiting_s() - waited_s
        self.body.wait()
        code = self.end_process(self.process, "the bridge of a killed body")
        if code != BODY_GONE:
            self.wrong(f"the bridge of a killed body ended with {code}")
        if took_s > min(TOLD_WITHIN_S + waited_s, TOLD_AT_ALL_S):
            self.wrong(f"the bridge took {took_s:.1f} s to say that its body is gone; the computer was overloaded for {waited_s:.1f} s of it")
        if (self.folder / "j.db-wal").exists():
            self.wrong("the journal was not closed when the body had gone")

    def kill_what_is_left(self):
        super().kill_what_is_left()
        if self.body and self.body.poll() is None:
            self.body.kill()
            self.body.wait()


class Worker(Run):
    """Bridge, journal and socket without a robot: `kill_worker` (tests/kills)."""

    WHEN = {"starting": 0.25, "asked for something": 0.4, "at work": 0.35}
    NAME = "worker"
    STEPS = 2

    def __init__(self, pons, folder, chance, kills, *, worker: Path):
        super().__init__(pons, folder, chance, kills)
        self.worker, self.ground = worker, folder / "ground"

    def steps(self, task):
        return [{"skill": "work", "arguments": {"task": task, "step": step}} for step in range(self.STEPS)]

    def start(self):
        self.process = self.launch(self.worker, self.journal, self.socket, self.ground)

    def begun(self):
        return ground(self.ground)[0]

    def live(self, when):
        if when == "starting":
            self.pause(0.06)
        elif self.until(self.hears, HANGS_S, "a worker has not answered"):
            self.pause(0.1)
            if when == "asked for something":
                self.kill_while_asking()

    def run(self):
        done = 0
        while done < self.planned and self.one_life() and not self.found.problems:
            done += 1
        if done < self.planned and not self.found.problems:
            self.wrong(f"a worker ended with {self.process.returncode}")
        if not self.found.problems:
            self.finish()
        self.end()

    def finish(self):
        self.start()
        self.until(self.hears, HANGS_S, "the last worker has not answered")
        quiet = time.monotonic()
        self.VISITS_S = float("inf")
        self.until(lambda: (ask(self.socket, {"op": "list", "limit": 1}) or {}).get("open", 1) == 0, LONGEST_S, "tasks stay open")
        self.found.sums["seconds to finish"] += round(time.monotonic() - quiet)
        self.process.send_signal(signal.SIGINT)
        if (code := self.process.wait()) != 0:
            self.wrong(f"the last worker ended with {code}")
        _, done = ground(self.ground)
        wanted = [f"{task} {step}" for task in self.sender.told for step in range(self.STEPS)]
        self.wrong(*(f"{step} was done {done[step]} times" for step in {*wanted, *done} if done[step] != 1))
        self.wrong(*without_outcome(self.journal, self.sender))
        self.found.sums["steps done once"] += len(done)


