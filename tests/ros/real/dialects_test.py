#!/usr/bin/env python3
"""Each dialect, asked by a real node of ROS 2 with the very messages that docs/dialects.md has for copying.

usage: dialects_test.py PONS [TEST ...]"""

import re
import sys
import unittest

import yaml

import kit

PONS = kit.pons_program()
COMMAND = re.compile(r'^ros2 topic pub [^/\n]*(/\S+) (\S+) (?:\\\n *)?"(\{.*\})"$', re.MULTILINE)


def fill(message, values: dict):
    """As `ros2 topic pub` does: by name, sequences of messages one by one."""
    kinds = message.get_fields_and_field_types()
    for name, value in values.items():
        element = re.fullmatch(r"sequence<(\w+)/(\w+)>", kinds[name])
        if element:
            value = [fill(kit.import_type(f"{element[1]}/msg/{element[2]}")(), each) for each in value]
        setattr(message, name, value)
    return message


class Dialects(unittest.TestCase):
    WORDS: tuple[str, ...] = ()  # of the run

    @classmethod
    def setUpClass(cls):
        text = (kit.ROOT / "docs" / "dialects.md").read_text()
        cls.commands = [(topic, kind, yaml.safe_load(values.replace('\\"', '"')))
                        for topic, kind, values in COMMAND.findall(text)]
        cls.run_ = kit.Run(PONS, "small_cell", "--stay", *cls.WORDS)
        cls.addClassCleanup(cls.run_.end)

    def setUp(self):
        self.peer = kit.Peer(self.run_)
        self.addCleanup(self.peer.close)

    def ask(self, topic: str, number: int = 0):
        """The document's command of that number to that topic; gives what publishes it again."""
        _, kind, values = [each for each in self.commands if each[0] == topic][number]
        publisher = self.peer.node.create_publisher(kit.import_type(kind), topic, 10)
        self.peer.until(f"{topic} is heard", lambda: publisher.get_subscription_count() > 0)
        message = fill(kit.import_type(kind)(), values)
        publisher.publish(message)
        return lambda: publisher.publish(message)

    def hear(self, kind: str, topic: str) -> list:
        heard = self.peer.hear(kind, topic)
        self.peer.until(topic, lambda: self.peer.node.count_publishers(topic) > 0)
        return heard

    def words(self, heard: list, name: str) -> list[str]:
        """What is said of a task until its end, without what is said again."""
        def ends():
            said = [each.status for each in heard if each.task_id == name]
            return said if said and said[-1] != "EXECUTING" else None
        said = self.peer.until(f"the end of {name}", ends)
        return [word for word, before in zip(said, [None, *said]) if word != before]


class OfAnArmAtRest(Dialects):
    def test_every_dialect_has_a_command(self):
        self.assertEqual({"/agent/task", "/brain/task_command", "/universal/task_command", "/high_level_tasks",
                          "/cerebellum/motion_trajectory", "/brain/high_level_cmd"},
                         {topic for topic, _, _ in self.commands})

    def test_agent(self):
        heard = self.hear("std_msgs/msg/String", "/bridge/task_status")
        self.ask("/agent/task")
        def told():
            of_it = [yaml.safe_load(each.data) for each in heard]
            said = [each["status"] for each in of_it if each["id"] == "look-1"]
            return said if said and said[-1] in ("SUCCEEDED", "FAILED") else None
        self.assertEqual(["ACCEPTED", "EXECUTING", "SUCCEEDED"], self.peer.until("the end", told))

    def test_brain(self):
        heard = self.hear("brain_interface/msg/TaskFeedback", "/brain/task_feedback")
        self.ask("/brain/task_command")
        self.assertEqual(["EXECUTING", "SUCCEEDED"], self.words(heard, "t1"))

    def test_universal(self):
        heard = self.hear("universal_robot_core/msg/TaskFeedback", "/universal/task_feedback")
        self.ask("/universal/task_command")
        self.assertEqual(["EXECUTING", "SUCCEEDED"], self.words(heard, "u1"))

    def test_motion(self):
        heard = self.hear("cerebellum_interface/msg/MotionStatus", "/cerebellum/motion_status")
        commands = self.hear("bridge_layer/msg/LowLevelCommand", "/low_level_command")
        self.ask("/cerebellum/motion_trajectory")
        self.peer.until("the end", lambda: heard and heard[-1].motion_status != "RUNNING")
        self.assertEqual("DONE", heard[-1].motion_status)
        progress = [each.progress for each in heard]
        self.assertEqual(progress, sorted(progress))
        self.assertGreater(len(set(progress)), 5)
        self.peer.until("what the arm is commanded", lambda: commands)
        self.assertEqual(commands[0].MOVE_TO_PICK, commands[0].type)
        self.assertGreater(commands[0].max_speed, 0)

    def test_set_points(self):
        heard = self.hear("std_msgs/msg/Float64MultiArray", "/cerebellum/low_level_cmd")
        self.peer.node.create_timer(1, self.ask("/brain/high_level_cmd"))
        wanted = [values["data"] for topic, _, values in self.commands if topic == "/brain/high_level_cmd"][0]
        def there():
            return heard and max(abs(one - other) for one, other in zip(heard[-1].data, wanted)) < 1e-3
        self.peer.until("it is there", there)
        self.assertGreater(len(heard), 100)


class OfParcels(Dialects):
    WORDS = ("--parcels", "7")

    def test_brain(self):
        heard = self.hear("brain_interface/msg/TaskFeedback", "/brain/task_feedback")
        self.ask("/brain/task_command", 1)  # of one that comes in a while
        self.peer.until("acceptance", lambda: heard)
        self.ask("/brain/task_command", 2)
        self.assertEqual(["EXECUTING", "FAILED"], self.words(heard, "t2"))
        self.assertIn("CANCELLED", heard[-1].detail)

    def test_high_level(self):
        heard = self.hear("bridge_layer/msg/ExecutionStatus", "/execution_status")
        self.ask("/high_level_tasks")  # as the world's own brain does: one of the two is late
        end = self.peer.until("the end", lambda: [each for each in heard if not each.in_progress])[0]
        self.assertTrue(heard[0].in_progress, heard)
        self.assertEqual([17] * len(heard), [each.task_id for each in heard])
        self.assertNotEqual(end.success, end.error_msg != "", heard)
        self.assertGreater(end.timestamp_ns, heard[0].timestamp_ns)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:], warnings="ignore")
