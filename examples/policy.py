#!/usr/bin/env python3
"""A policy outside of Pons: sways the arm about where it stands, chunk by chunk.

    pons run small_cell --realtime --parcels 5 --socket /tmp/pons.sock &
    examples/policy.py /tmp/pons.sock

Put a model where `act` is: it gets what `observe` answers and says where the arm shall be, one action every PERIOD_S.
"""

import json
import math
import socket
import sys

PERIOD_S = 0.05
ACTIONS = 20  # in a chunk: 1 s
EVERY = 4  # a new chunk whenever so many actions have been executed: five a second
SECONDS = 6.0


def act(home, first, count):
    """So many actions, when `first` (a real number) of the stream have been executed: joint angles (rad)."""
    sway = [0.05 * math.sin(0.5 * math.pi * PERIOD_S * (first + j + 1)) for j in range(count)]
    return [[home[0] + s, *home[1:]] for s in sway]


class Pons:
    """One JSON object a line, one line back."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(path)
        self.lines = self.socket.makefile("rw")

    def ask(self, **question):
        self.lines.write(json.dumps(question) + "\n")
        self.lines.flush()
        return json.loads(self.lines.readline())


def main(path, task_id="sway"):
    pons = Pons(path)
    step = {"skill": "follow_policy", "arguments": {"policy": "outside", "seconds": 60}}
    answer = pons.ask(op="submit", task={"id": task_id, "priority": 90, "steps": [step]})
    if not answer["ok"]:
        sys.exit(answer["error"])
    while not (seen := pons.ask(op="observe"))["ok"]:
        pass  # the arm is at something else; answers come at the bridge's pace
    home, ends, chunks, asked, last = seen["position"], round(SECONDS / PERIOD_S), 0, -EVERY, False
    while seen["ok"]:
        observed = seen["executed"]
        # After a stop nothing of what was sent is left, the last chunk neither.
        is_time = seen["enough_s"] == 0 or (observed >= asked + EVERY and not last)
        if is_time and observed < ends - 1e-6:
            count = min(ACTIONS, math.ceil(ends - observed))
            chunk = {"observed": observed, "period_ms": 1e3 * PERIOD_S, "actions": act(home, observed, count)}
            ends_it = observed + count >= ends
            answer = pons.ask(op="chunk", stream=seen["stream"], last=ends_it, **chunk)
            if answer["ok"]:
                asked, chunks, last = observed, chunks + 1, ends_it
            elif not answer["error"].startswith("chunk_st"):  # stopped, or as it was before the arm was
                sys.exit(answer["error"])
        seen = pons.ask(op="observe")
    if not last:
        sys.exit(seen["error"])
    print(f"{chunks} chunks sent")


if __name__ == "__main__":
    main(*sys.argv[1:])
