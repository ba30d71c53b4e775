#!/usr/bin/env python3
"""The other side of bench/trajectory_generation: the same tasks planned by Ruckig.

usage: ruckig_peer.py INPUT OUTPUT

INPUT: three little-endian doubles (cases, axes, 1 for time synchronisation or 0 for none), then for each case and axis
position, speed, acceleration, end position, end speed, least and greatest speed, least and greatest acceleration, jerk.
OUTPUT: for each case the duration in s (negative: Ruckig's error code) and the time of calculation in µs as Ruckig's own
C++ measures it, so that Python's share does not count."""

import array
import sys

import ruckig

ROW = 10


def main() -> int:
    numbers = array.array("d")
    with open(sys.argv[1], "rb") as file:
        numbers.frombytes(file.read())
    cases, axes, together = int(numbers[0]), int(numbers[1]), numbers[2] != 0
    generator = ruckig.Ruckig(axes, 0.001)
    task, output = ruckig.InputParameter(axes), ruckig.OutputParameter(axes)
    task.synchronization = ruckig.Synchronization.Time if together else ruckig.Synchronization.No
    results = array.array("d")
    for case in range(cases):
        begin = 3 + case * axes * ROW
        column = [list(numbers[begin + k:begin + axes * ROW:ROW]) for k in range(ROW)]
        task.current_position, task.current_velocity, task.current_acceleration = column[0], column[1], column[2]
        task.target_position, task.target_velocity = column[3], column[4]
        task.min_velocity, task.max_velocity = column[5], column[6]
        task.min_acceleration, task.max_acceleration, task.max_jerk = column[7], column[8], column[9]
        generator.reset()
        try:
            result = generator.update(task, output)
        except ruckig.RuckigError:
            result = ruckig.Result.ErrorInvalidInput
        good = result in (ruckig.Result.Working, ruckig.Result.Finished)
        results.append(output.trajectory.duration if good else float(result))
        results.append(output.calculation_duration if good else 0.0)
    with open(sys.argv[2], "wb") as file:
        results.tofile(file)
    return 0


if __name__ == "__main__":
    sys.exit(main())
