#!/usr/bin/env python3
"""Whole runs as a viewer sees them: over PyPI's websockets, each message decoded by the schema that its channel tells,
with MCAP's own library of Python.

usage: viewer_test.py PONS     run by .venv-check's interpreter"""

import json
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

PONS = sys.argv[1]
LONG_ENOUGH_S = 60
HOME = {"id": "home-1", "priority": 90, "steps": [{"skill": "move_to", "arguments": {"place": "home"}}]}


class Run:
    """The program at work; ended with its test."""

    def __init__(self, test, *words):
        self.process = subprocess.Popen([PONS, *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                        text=True)
        self.lines, self.changed = [], threading.Condition()
        self.listens = threading.Thread(target=self.listen)
        self.listens.start()
        test.addCleanup(self.end)

    def listen(self):
        for line in self.process.stderr:
            with self.changed:
                self.lines.append(line)
                self.changed.notify_all()
        with self.changed:
            self.lines.append("it has ended\n")
            self.changed.notify_all()

    def said(self):
        with self.changed:
            return "".join(self.lines)

    def where(self):
        """As it says itself."""
        def found():
            return re.search(r"foxglove: (ws://\S+)\n|it has ended", "".join(self.lines))
        with self.changed:
            assert self.changed.wait_for(found, LONG_ENOUGH_S), "it does not listen"
            assert found()[1], "".join(self.lines)
            return found()[1]

    def end(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        code = self.process.wait(LONG_ENOUGH_S)
        self.listens.join()
        self.process.stderr.close()
        return code


class Viewer:
    def __init__(self, test, url, **options):
        options.setdefault("subprotocols", ["foxglove.websocket.v1"])
        self.socket = test.enterContext(connect(url, max_size=None, compression=None, **options))
        self.info = json.loads(self.socket.recv(LONG_ENOUGH_S))
        self.channels, self.services, self.decoders = {}, {}, {}
        self.statuses, self.failures, self.responses, self.times = [], [], {}, []
        self.got = {}  # by topic: (log time, value)
        while not self.channels:
            self.hear()

    def hear(self):
        message = self.socket.recv(LONG_ENOUGH_S)
        if isinstance(message, str):
            self.hear_text(json.loads(message))
        elif message[0] == 1:
            subscription, logged = struct.unpack_from("<xIQ", message)
            channel = self.channels[subscription]  # as subscribe() numbers them
            self.got.setdefault(channel["topic"], []).append((logged, self.decode(channel, message[13:])))
        elif message[0] == 2:
            self.times.append(struct.unpack_from("<xQ", message)[0])
        elif message[0] == 3:
            service, call, length = struct.unpack_from("<xIII", message)
            self.responses[call] = (service, message[13:13 + length], message[13 + length:])
        else:
            raise AssertionError(f"what is {message[:20]}?")

    def hear_text(self, message):
        if message["op"] == "advertise":
            self.channels |= {channel["id"]: channel for channel in message["channels"]}
        elif message["op"] == "advertiseServices":
            self.services |= {service["name"]: service for service in message["services"]}
        elif message["op"] == "status":
            self.statuses.append(message)
        elif message["op"] == "serviceCallFailure":
            self.failures.append(message)
        else:
            raise AssertionError(f"what is {message}?")

    def hear_until(self, condition):
        until = time.monotonic() + LONG_ENOUGH_S
        while not condition():
            assert time.monotonic() < until, "it did not come"
            self.hear()

    def decode(self, channel, data):
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        if channel["id"] not in self.decoders:
            name = channel["schemaName"]
            self.decoders[channel["id"]] = generate_dynamic(name, channel["schema"])[name]
        return self.decoders[channel["id"]](data)

    def subscribe(self, *topics):
        ids = [number for number, channel in self.channels.items() if not topics or channel["topic"] in topics]
        self.socket.send(json.dumps(
            {"op": "subscribe", "subscriptions": [{"id": number, "channelId": number} for number in ids]}))
        return [self.channels[number]["topic"] for number in ids]

    def call(self, name, number, request):
        """The answer, as an object."""
        service = self.services[name]
        half = service["request"]
        data = serialize_dynamic(half["schemaName"], half["schema"])[half["schemaName"]](request)
        self.socket.send(struct.pack("<BIII", 2, service["id"], number, 3) + b"cdr" + data)
        self.hear_until(lambda: number in self.responses)
        half = service["response"]
        return generate_dynamic(half["schemaName"], half["schema"])[half["schemaName"]](self.responses[number][2])


def frames_of(messages):
    return {each.child_frame_id: each.header.frame_id for _, message in messages for each in message.transforms}


class Viewers(unittest.TestCase):
    maxDiff = None

    def test_an_arm_by_the_clock_shows_all_that_it_is(self):
        run = Run(self, "run", "small_cell", "--parcels", "100", "--realtime", "--quiet", "--foxglove", "0",
                  "--socket", self.folder() / "s")
        url = run.where()
        for subprotocol in ("foxglove.websocket.v1", "foxglove.sdk.v1"):
            viewer = Viewer(self, url, subprotocols=["rosbridge", subprotocol])
            self.assertEqual(viewer.socket.subprotocol, subprotocol)
        self.assertEqual(viewer.info["op"], "serverInfo")
        self.assertEqual(viewer.info["capabilities"], ["time"])
        self.assertEqual(viewer.info["metadata"], {"world": "small_cell"})
        topics = viewer.subscribe()
        self.assertLessEqual({"/joint_states", "/tf", "/tf_static", "/robot_description", "/clock"}, set(topics))
        viewer.hear_until(lambda: len(viewer.got.get("/joint_states", [])) > 100 and len(viewer.times) > 10)
        self.assertEqual([], viewer.statuses)
        # Sent before it came.
        self.assertIn("<robot", viewer.got["/robot_description"][0][1].data)
        logged, joints = viewer.got["/joint_states"][-1]
        self.assertEqual(7, len(joints.name))
        self.assertEqual(7, len(joints.position))
        stamps = [at for at, _ in viewer.got["/joint_states"]]
        self.assertEqual(stamps, sorted(set(stamps)))
        self.assertEqual(viewer.times, sorted(set(viewer.times)))
        self.assertLess(abs(logged - viewer.times[-1]), 1e9)
        self.assertLess(abs(logged - joints.header.stamp.sec * 10**9 - joints.header.stamp.nanosec), 1e9)
        frames = frames_of(viewer.got["/tf"] + viewer.got["/tf_static"])
        frame = "tool_tip"
        for _ in range(20):
            frame = frames.get(frame, frame)
        self.assertEqual("world", frame)
        run.process.send_signal(signal.SIGINT)
        with self.assertRaises(ConnectionClosed) as closed:
            viewer.hear_until(lambda: False)
        self.assertEqual(1001, closed.exception.rcvd.code)
        self.assertEqual(130, run.end())

    def test_virtual_time_goes_as_fast_as_it_goes(self):
        run = Run(self, "run", "parcel_cell", "--parcels", "2", "--foxglove", "0")
        viewer = Viewer(self, run.where())
        viewer.subscribe("/joint_states", "/robot_description")
        with self.assertRaises(ConnectionClosed):
            viewer.hear_until(lambda: False)
        self.assertEqual(0, run.end())
        self.assertGreater(viewer.times[-1], 10e9)
        self.assertGreater(len(viewer.got["/joint_states"]), 500)
        # To the end: what was put last was sent before it said goodbye.
        self.assertGreaterEqual(viewer.got["/joint_states"][-1][0], viewer.times[-1] - 10**9)

    def test_a_base_shows_itself_too(self):
        run = Run(self, "run", "rounds", "--realtime", "--quiet", "--foxglove", "0", "--socket", self.folder() / "s")
        viewer = Viewer(self, run.where())
        self.assertLessEqual({"/odom", "/map", "/tf"}, set(viewer.subscribe()))
        viewer.hear_until(lambda: {"/odom", "/map", "/tf", "/clock"} <= viewer.got.keys())
        self.assertGreater(viewer.got["/map"][0][1].info.width, 0)
        self.assertEqual([], viewer.statuses)

    def test_a_bridge_shows_the_body_of_another_process(self):
        folder, link = self.folder(), f"foxglove-{self.id().rsplit('.')[-1][:20]}"
        body = Run(self, "body", "small_cell", "--parcels", "100", "--link", link, "--quiet")
        bridge = Run(self, "bridge", "small_cell", "--parcels", "100", "--link", link, "--quiet", "--wait", "60",
                     "--journal", folder / "j.db", "--socket", folder / "s", "--foxglove", "localhost:0")
        viewer = Viewer(self, bridge.where())
        viewer.subscribe("/joint_states")
        viewer.hear_until(lambda: len(viewer.got.get("/joint_states", [])) > 10)
        self.assertEqual(130, bridge.end())
        body.end()

    def test_tasks_are_taken_where_they_may_be_asked_for(self):
        folder = self.folder()
        run = Run(self, "run", "small_cell", "--parcels", "100", "--realtime", "--quiet", "--foxglove", "0",
                  "--foxglove-tasks", "--socket", folder / "s", "--journal", folder / "j.db")
        viewer = Viewer(self, run.where())
        self.assertEqual(viewer.info["capabilities"], ["time", "services"])
        viewer.hear_until(lambda: viewer.services)
        submit, command = "/pons/submit_task", "/pons/command_task"
        self.assertEqual({submit, command}, viewer.services.keys())
        accepted = viewer.call(submit, 1, {"task": json.dumps(HOME)})
        self.assertEqual((True, "home-1", ""), (accepted.ok, accepted.id, accepted.error))
        self.assertIn("'fly'", viewer.call(submit, 2, {"task": '{"id":"x","steps":[{"skill":"fly"}]}'}).error)
        self.assertIn("JSON", viewer.call(submit, 3, {"task": "not JSON"}).error)
        self.assertIn("several tasks", viewer.call(submit, 4, {"task": '{"tasks":[]}'}).error)
        self.assertIn("'nobody'", viewer.call(command, 5, {"id": "nobody", "verb": 3, "reason": ""}).error)
        self.assertIn("9 is no verb", viewer.call(command, 6, {"id": "home-1", "verb": 9, "reason": ""}).error)
        waits = {"id": "watch", "steps": [{"skill": "detect", "arguments": {"object": "nobody", "within_s": 60}}]}
        self.assertTrue(viewer.call(submit, 7, {"task": json.dumps(waits)}).ok)
        self.assertTrue(viewer.call(command, 8, {"id": "watch", "verb": 3, "reason": "lunch"}).ok)
        viewer.socket.send(struct.pack("<BIII", 2, 0, 9, 3) + b"cdr" + b"\0")
        viewer.hear_until(lambda: viewer.failures)
        self.assertEqual(9, viewer.failures[0]["callId"])
        run.end()
        told = subprocess.run([PONS, "task", "history", "watch", "--journal", folder / "j.db"], capture_output=True,
                              text=True)
        self.assertIn("lunch", told.stdout)
        self.assertIn("CANCELLED", told.stdout)

    def test_who_may_not_look_is_told_so_as_is_the_robots_owner(self):
        run = Run(self, "run", "small_cell", "--parcels", "100", "--realtime", "--quiet", "--foxglove", "0",
                  "--foxglove-origin", "https://viewer.example", "--socket", self.folder() / "s")
        url = run.where()
        for status, options in ((403, {"origin": "https://evil.example"}), (400, {"subprotocols": ["rosbridge"]})):
            with self.assertRaises(InvalidStatus) as refused:
                Viewer(self, url, **options)
            self.assertEqual(status, refused.exception.response.status_code)
        viewer = Viewer(self, url, origin="https://viewer.example")
        viewer.socket.send("hello")
        viewer.hear_until(lambda: viewer.statuses)
        self.assertEqual(2, viewer.statuses[0]["level"])
        # No services were offered.
        viewer.socket.send(struct.pack("<BIII", 2, 0, 7, 3) + b"cdr" + b"\0")
        viewer.hear_until(lambda: viewer.failures)
        run.end()
        self.assertIn("pages of https://evil.example may not look", run.said())
        self.assertIn("'rosbridge'", run.said())

    def test_what_cannot_be_is_refused_before_the_run(self):
        taken = self.enterContext(socket.create_server(("127.0.0.1", 0)))
        port = taken.getsockname()[1]
        for words, told in ((("--foxglove", "robot:8765"), "'robot:8765' names no address"),
                            (("--foxglove", "127.0.0.1"), "names no port"),
                            (("--foxglove", port), f"127.0.0.1:{port}: the port is taken"),
                            (("--foxglove", "0", "--foxglove-origin", "viewer.example"),
                             "'viewer.example' is no origin"),
                            (("--foxglove-tasks",), "--foxglove")):
            run = subprocess.run([PONS, "run", "small_cell", "--parcels", "1", "--quiet", *map(str, words)],
                                 capture_output=True, text=True, timeout=LONG_ENOUGH_S)
            self.assertEqual(2, run.returncode, words)
            self.assertIn(told, run.stderr)

    def folder(self):
        return Path(self.enterContext(tempfile.TemporaryDirectory()))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
