#!/usr/bin/env python3
"""An arm by the clock beside real nodes of ROS 2: rclpy, rcl, rmw_fastrtps_cpp and Fast DDS as they come.

usage: arm_test.py PONS     run by .venv-ros's interpreter (make ros-peers)"""

import json
import shutil
import statistics
import subprocess
import sys
import unittest
from pathlib import Path

from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory
from lifecycle_msgs.msg import State, Transition
from pons_msgs.action import ExecuteTask
from pons_msgs.msg import RobotState, TaskStatus
from pons_msgs.srv import CommandTask
from rclpy.action import ActionClient, get_action_server_names_and_types_by_node
from rclpy.clock import Clock
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from std_msgs.msg import Bool
from trajectory_msgs.msg import JointTrajectoryPoint

import kit

PONS = kit.pons_program()
HOME = [0.0, -0.2067, 0.0, -2.3596, 0.0, 2.1529, 0.0]
TOPICS = {
    "/joint_states": "sensor_msgs/msg/JointState", "/robot_description": "std_msgs/msg/String",
    "/tf": "tf2_msgs/msg/TFMessage", "/tf_static": "tf2_msgs/msg/TFMessage", "/clock": "rosgraph_msgs/msg/Clock",
    "/rosout": "rcl_interfaces/msg/Log", "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/parameter_events": "rcl_interfaces/msg/ParameterEvent", "/emergency_stop": "std_msgs/msg/Bool",
    "/overhead/image_raw": "sensor_msgs/msg/Image", "/overhead/depth/image_rect_raw": "sensor_msgs/msg/Image",
    "/overhead/image_raw/compressed": "sensor_msgs/msg/CompressedImage",
    "/overhead/camera_info": "sensor_msgs/msg/CameraInfo", "/pons/task_status": "pons_msgs/msg/TaskStatusArray",
    "/pons/task_events": "pons_msgs/msg/TaskEvent", "/pons/state": "pons_msgs/msg/RobotState",
    "/pons/commands": "pons_msgs/msg/LinkCommand", "/pons/beliefs": "pons_msgs/msg/ObjectBeliefArray",
    "/pons/transition_event": "lifecycle_msgs/msg/TransitionEvent"}
SERVICES = {
    "/pons/submit_task": "pons_msgs/srv/SubmitTask", "/pons/command_task": "pons_msgs/srv/CommandTask",
    **{f"/pons/{name}": "std_srvs/srv/Trigger" for name in ("stop", "emergency_stop", "reset", "arm")},
    **{f"/pons/{name}": f"rcl_interfaces/srv/{kind}" for name, kind in (
        ("list_parameters", "ListParameters"), ("get_parameters", "GetParameters"), ("set_parameters", "SetParameters"),
        ("get_parameter_types", "GetParameterTypes"), ("describe_parameters", "DescribeParameters"),
        ("set_parameters_atomically", "SetParametersAtomically"))},
    **{f"/pons/{name}": f"lifecycle_msgs/srv/{kind}" for name, kind in (
        ("get_state", "GetState"), ("change_state", "ChangeState"), ("get_available_states", "GetAvailableStates"),
        ("get_available_transitions", "GetAvailableTransitions"), ("get_transition_graph", "GetAvailableTransitions"))}}
ACTIONS = {"/pons/execute_task": "pons_msgs/action/ExecuteTask",
           "/joint_trajectory_controller/follow_joint_trajectory": "control_msgs/action/FollowJointTrajectory"}
DOOR = """
  - name: open_door
    service: /door/open
    type: std_srvs/srv/Trigger
    timeout_s: 60
    server_wait_s: 5
    success: success
    reason: message
"""


def task(name: str, skill: str, **arguments) -> str:
    return json.dumps({"id": name, "steps": [{"skill": skill, "arguments": arguments}]})


def home(name: str) -> str:
    return task(name, "move_to", place="home")


def waits(name: str) -> str:
    return task(name, "detect", object="nobody", within_s=60)


class Arm(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        worlds = Path(kit.FOLDER.name) / "arm_worlds"
        shutil.copytree(kit.ROOT / "worlds", worlds)
        world = worlds / "small_cell" / "world.yaml"
        world.write_text(world.read_text() + "\nskills:" + DOOR)
        cls.run_ = kit.Run(PONS, "small_cell", "--stay", worlds=worlds)
        cls.addClassCleanup(cls.run_.end)

    def setUp(self):
        self.peer = kit.Peer(self.run_)
        self.addCleanup(self.peer.close)

    def outcome(self, name: str) -> TaskStatus:
        """Of a task, when it has ended."""
        status = self.peer.hear("pons_msgs/msg/TaskStatusArray", "/pons/task_status", kit.LATCHED)
        def ended():
            return [each for message in status for each in message.tasks
                    if each.id == name and each.state == TaskStatus.STATE_ENDED]
        return self.peer.until(f"the end of {name}", ended)[0]

    def test_the_graph_has_the_node_its_topics_services_and_actions(self):
        node = self.peer.node
        self.peer.until("/pons", lambda: ("pons", "/") in node.get_node_names_and_namespaces())
        def seen():
            return {name: types for name, types in node.get_topic_names_and_types() if name in TOPICS}
        self.peer.until("its topics", lambda: len(seen()) == len(TOPICS))
        self.assertEqual({name: [kind] for name, kind in TOPICS.items()}, seen())
        self.peer.until("its services", lambda: set(SERVICES) <= {
            name for name, _ in node.get_service_names_and_types_by_node("pons", "/")})
        served = dict(node.get_service_names_and_types_by_node("pons", "/"))
        self.assertEqual({name: [kind] for name, kind in SERVICES.items()}, {name: served[name] for name in SERVICES})
        def actions():
            return dict(get_action_server_names_and_types_by_node(node, "pons", "/"))
        self.peer.until("its actions", lambda: set(ACTIONS) <= set(actions()))
        self.assertEqual({name: [kind] for name, kind in ACTIONS.items()}, actions())

    def test_every_topics_type_has_the_hash_that_rosidl_gives_it(self):
        node, compared = self.peer.node, set()
        def ends_of(topic):
            ends = node.get_publishers_info_by_topic(topic) + node.get_subscriptions_info_by_topic(topic)
            return [each for each in ends if each.node_name == "pons"]
        self.peer.until("its topics", lambda: all(map(ends_of, TOPICS)))
        for topic, (kind, *_) in node.get_topic_names_and_types():
            theirs = {str(each.topic_type_hash) for each in ends_of(topic)}
            if not theirs:
                continue
            own = node.create_subscription(kit.import_type(kind), topic, lambda _: None, 1)
            ours = {str(each.topic_type_hash) for each in node.get_subscriptions_info_by_topic(topic)
                    if each.node_name == node.get_name()}
            node.destroy_subscription(own)
            with self.subTest(topic):
                self.assertEqual(ours, theirs)
            compared.add(kind)
        self.assertLessEqual(set(TOPICS.values()), compared)
        for package in ("bridge_layer", "brain_interface", "cerebellum_interface", "universal_robot_core"):
            self.assertTrue([kind for kind in compared if kind.startswith(package)], package)

    def test_its_log_is_kept_as_long_as_that_of_others(self):
        def qualities(name):
            return [each.qos_profile for each in self.peer.node.get_publishers_info_by_topic("/rosout")
                    if each.node_name == name]
        theirs = self.peer.until("its log", lambda: qualities("pons"))[0]
        ours = self.peer.until("our log", lambda: qualities(self.peer.node.get_name()))[0]
        for quality in ("reliability", "durability", "lifespan"):
            self.assertEqual(getattr(ours, quality), getattr(theirs, quality), quality)

    def test_joint_states_come_a_hundred_a_second_with_the_stamps_of_its_clock(self):
        self.peer.until("/clock", lambda: self.peer.node.get_clock().now().nanoseconds > 0)
        ages = []
        states = self.peer.hear("sensor_msgs/msg/JointState", "/joint_states")
        self.peer.node.create_subscription(
            kit.import_type("sensor_msgs/msg/JointState"), "/joint_states", lambda state: ages.append(
                self.peer.node.get_clock().now().nanoseconds * 1e-9 - kit.seconds(state.header.stamp)), 100)
        self.peer.until("states", lambda: len(states) > 300)
        stamps = [kit.seconds(each.header.stamp) for each in states]
        self.assertEqual(stamps, sorted(set(stamps)))
        self.assertAlmostEqual(0.01, statistics.median(b - a for a, b in zip(stamps, stamps[1:])), delta=0.001)
        self.assertLess(statistics.median(map(abs, ages)), 0.1)
        self.assertEqual([f"joint{number}" for number in range(1, 8)], states[-1].name)
        for each in (states[-1].position, states[-1].velocity, states[-1].effort):
            self.assertEqual(7, len(each))

    def test_who_comes_late_has_the_robots_description_and_its_frames(self):
        descriptions = self.peer.hear("std_msgs/msg/String", "/robot_description", kit.LATCHED)
        fixed = self.peer.hear("tf2_msgs/msg/TFMessage", "/tf_static", kit.LATCHED)
        moving = self.peer.hear("tf2_msgs/msg/TFMessage", "/tf")
        self.peer.until("all three", lambda: descriptions and fixed and moving)
        self.assertIn("<robot", descriptions[0].data)
        hangs_on = {each.child_frame_id: each.header.frame_id for each in (*fixed[0].transforms, *moving[0].transforms)}
        frame = "tool_tip"
        for _ in range(20):
            frame = hangs_on.get(frame, frame)
        self.assertEqual("world", frame)

    def test_parameters_are_listed_got_and_set(self):
        client = AsyncParameterClient(self.peer.node, "pons")
        self.peer.until("its parameters", client.services_are_ready)
        done = self.peer.done
        names = ["use_sim_time", "version", "world", "states_rate_hz", "images_rate_hz"]
        self.assertEqual(names, list(done("list", client.list_parameters()).result.names))
        values = done("get", client.get_parameters(names)).values
        kinds = [Parameter.Type[name] for name in ("BOOL", "STRING", "STRING", "DOUBLE", "DOUBLE")]
        self.assertEqual(kinds, [Parameter.Type(each.type) for each in values])
        self.assertEqual("small_cell", values[2].string_value)
        self.assertRegex(values[1].string_value, r"^\d+\.\d+")
        self.assertEqual([each.value for each in kinds], list(done("types", client.get_parameter_types(names)).types))
        described = done("describe", client.describe_parameters(names)).descriptors
        self.assertEqual([True, True, True, False, False], [each.read_only for each in described])

        def set_one(value):
            return done("set", client.set_parameters([Parameter("states_rate_hz", value=value)])).results[0]
        events = self.peer.hear("rcl_interfaces/msg/ParameterEvent", "/parameter_events")
        self.peer.until("its events", lambda: self.peer.node.count_publishers("/parameter_events") > 1)
        self.assertTrue(set_one(10.0).successful)
        self.peer.until("an event", lambda: [each for each in events if each.node == "/pons"])
        states = self.peer.hear("sensor_msgs/msg/JointState", "/joint_states")
        self.peer.until("states", lambda: len(states) > 20)
        stamps = [kit.seconds(each.header.stamp) for each in states]
        self.assertAlmostEqual(0.1, statistics.median(b - a for a, b in zip(stamps, stamps[1:])), delta=0.02)
        refused = set_one(10)
        self.assertFalse(refused.successful)
        self.assertIn("double", refused.reason)
        self.assertTrue(set_one(0.0).successful)

    def change_state(self, transition: int) -> bool:
        return self.peer.ask("lifecycle_msgs/srv/ChangeState", "/pons/change_state",
                             transition=Transition(id=transition)).success

    def test_its_lifecycle_is_that_of_a_managed_node(self):
        def state():
            return self.peer.ask("lifecycle_msgs/srv/GetState", "/pons/get_state").current_state
        self.assertEqual((State.PRIMARY_STATE_ACTIVE, "active"), (state().id, state().label))
        events = self.peer.hear("lifecycle_msgs/msg/TransitionEvent", "/pons/transition_event")
        self.peer.until("its events", lambda: self.peer.node.count_publishers("/pons/transition_event"))
        self.assertTrue(self.change_state(Transition.TRANSITION_DEACTIVATE))
        self.assertEqual((State.PRIMARY_STATE_INACTIVE, "inactive"), (state().id, state().label))
        self.assertFalse(self.change_state(Transition.TRANSITION_CONFIGURE))
        self.assertTrue(self.change_state(Transition.TRANSITION_ACTIVATE))
        self.assertEqual("active", state().label)
        self.peer.until("its events", lambda: [each.goal_state.label for each in events] == [
            "deactivating", "inactive", "activating", "active"])

    def trigger(self, name: str) -> str:
        answer = self.peer.ask("std_srvs/srv/Trigger", f"/pons/{name}")
        self.assertTrue(answer.success, answer.message)
        return answer.message

    def until_safety(self, states: list, safety: int):
        self.peer.until(f"safety {safety}", lambda: states and states[-1].safety == safety)

    def test_stops_that_services_ask_for_are_left_by_reset_and_arm(self):
        states = self.peer.hear("pons_msgs/msg/RobotState", "/pons/state")
        for name, safety in (("stop", RobotState.SAFETY_PROTECTIVE_STOP),
                             ("emergency_stop", RobotState.SAFETY_EMERGENCY_STOP)):
            with self.subTest(name):
                self.trigger(name)
                self.until_safety(states, safety)
                self.trigger("reset")
                self.trigger("arm")
                self.until_safety(states, RobotState.SAFETY_OPERATIONAL)

    def test_a_button_that_is_published_as_best_effort_stops_the_arm(self):
        states = self.peer.hear("pons_msgs/msg/RobotState", "/pons/state")
        for qos in (qos_profile_sensor_data, QoSProfile(depth=1)):
            with self.subTest(str(qos.reliability)):
                button = self.peer.node.create_publisher(Bool, "/emergency_stop", qos)
                self.peer.until("a reader", button.get_subscription_count)
                # Again and again: what is sent as best effort before its reader knows the writer is lost.
                timer = self.peer.node.create_timer(0.1, lambda: button.publish(Bool(data=True)), clock=Clock())
                self.until_safety(states, RobotState.SAFETY_EMERGENCY_STOP)
                timer.cancel()
                self.assertEqual(RobotState.CAUSE_EMERGENCY_WORD, states[-1].cause)
                button.publish(Bool(data=False))
                self.trigger("reset")
                self.trigger("arm")
                self.until_safety(states, RobotState.SAFETY_OPERATIONAL)

    def test_a_task_is_submitted_commanded_and_ends(self):
        answer = self.peer.ask("pons_msgs/srv/SubmitTask", "/pons/submit_task", task=home("home-1"))
        self.assertEqual((True, "home-1", ""), (answer.ok, answer.id, answer.error))
        self.assertEqual(TaskStatus.OUTCOME_SUCCEEDED, self.outcome("home-1").outcome)
        refused = self.peer.ask("pons_msgs/srv/SubmitTask", "/pons/submit_task", task=task("odd", "juggle"))
        self.assertFalse(refused.ok)
        self.assertIn("juggle", refused.error)
        self.assertTrue(self.peer.ask("pons_msgs/srv/SubmitTask", "/pons/submit_task", task=waits("watch-1")).ok)
        self.assertTrue(self.peer.ask("pons_msgs/srv/CommandTask", "/pons/command_task", id="watch-1",
                                      verb=CommandTask.Request.CANCEL, reason="lunch").ok)
        ended = self.outcome("watch-1")
        self.assertEqual(TaskStatus.OUTCOME_CANCELLED, ended.outcome)
        self.assertIn("lunch", ended.reason)

    def send(self, kind, action: str, goal, heard: list | None = None):
        """The handle of a goal that was accepted; None: it was rejected."""
        client = ActionClient(self.peer.node, kind, action)
        self.peer.until(f"{action} is served", client.server_is_ready)
        keep = None if heard is None else lambda message: heard.append(message.feedback)
        handle = self.peer.done("acceptance", client.send_goal_async(goal, feedback_callback=keep))
        self.assertTrue(handle.accepted)
        return handle

    def execute(self, text: str, heard: list | None = None):
        return self.send(ExecuteTask, "/pons/execute_task", ExecuteTask.Goal(task=text), heard)

    def test_the_action_execute_task_tells_each_event_and_the_outcome(self):
        heard = []
        told = self.peer.hear("pons_msgs/action/ExecuteTask_FeedbackMessage", "/pons/execute_task/_action/feedback")
        result = self.peer.done("a result", self.execute(home("home-2"), heard).get_result_async())
        self.assertEqual(GoalStatus.STATUS_SUCCEEDED, result.status)
        self.assertEqual((ExecuteTask.Result.SUCCEEDED, "home-2", ""),
                         (result.result.outcome, result.result.task_id, result.result.reason))
        # rclpy's client of the action hears nothing more once it has the result.
        self.assertEqual(["accepted", "started", "attempt"], [each.kind for each in heard][:3])
        self.peer.until("the last event", lambda: told and told[-1].feedback.kind == "ended")
        sequences = [each.feedback.sequence for each in told]
        self.assertEqual(sequences, sorted(set(sequences)))

    def test_the_action_execute_task_is_cancelled_and_aborted(self):
        goal = self.execute(waits("watch-2"))
        cancelled = self.peer.done("an answer", goal.cancel_goal_async())
        self.assertEqual([bytes(goal.goal_id.uuid)], [bytes(each.goal_id.uuid) for each in cancelled.goals_canceling])
        result = self.peer.done("a result", goal.get_result_async())
        self.assertEqual((GoalStatus.STATUS_CANCELED, ExecuteTask.Result.CANCELLED),
                         (result.status, result.result.outcome))
        result = self.peer.done("a result", self.execute(task("odd-2", "juggle")).get_result_async())
        self.assertEqual((GoalStatus.STATUS_ABORTED, ExecuteTask.Result.NONE), (result.status, result.result.outcome))
        self.assertIn("juggle", result.result.reason)

    def follow(self, positions: list[float], after_s: int, heard: list | None = None, joints=range(1, 8)):
        goal = FollowJointTrajectory.Goal()
        goal.trajectory.joint_names = [f"joint{number}" for number in joints]
        goal.trajectory.points = [JointTrajectoryPoint(positions=positions, time_from_start=Duration(sec=after_s))]
        return self.send(FollowJointTrajectory, "/joint_trajectory_controller/follow_joint_trajectory", goal, heard)

    def test_an_arm_follows_a_trajectory_as_a_joint_trajectory_controller_does(self):
        heard, there = [], [0.4, *HOME[1:6], 0.3]
        result = self.peer.done("a result", self.follow(there, 3, heard).get_result_async())
        self.assertEqual((GoalStatus.STATUS_SUCCEEDED, FollowJointTrajectory.Result.SUCCESSFUL),
                         (result.status, result.result.error_code), result.result.error_string)
        self.assertGreater(len(heard), 30)
        self.assertEqual([f"joint{number}" for number in range(1, 8)], heard[-1].joint_names)
        states = self.peer.hear("sensor_msgs/msg/JointState", "/joint_states")
        self.peer.until("a state", lambda: states)
        for asked, measured in zip(there, states[-1].position):
            self.assertAlmostEqual(asked, measured, delta=0.01)

    def test_a_trajectory_is_cancelled_replaced_and_refused(self):
        heard = []
        goal = self.follow([1.0, *HOME[1:]], 20, heard)
        self.peer.until("feedback", lambda: heard)
        self.assertEqual(1, len(self.peer.done("an answer", goal.cancel_goal_async()).goals_canceling))
        self.assertEqual(GoalStatus.STATUS_CANCELED, self.peer.done("a result", goal.get_result_async()).status)

        replaced = self.follow([1.0, *HOME[1:]], 20)
        result = self.peer.done("a result", self.follow(HOME, 5).get_result_async())
        self.assertEqual(GoalStatus.STATUS_SUCCEEDED, result.status, result.result.error_string)
        self.assertEqual(GoalStatus.STATUS_ABORTED, self.peer.done("a result", replaced.get_result_async()).status)

        refused = self.peer.done("a result", self.follow(HOME[:3], 3, joints=range(1, 4)).get_result_async())
        self.assertEqual((GoalStatus.STATUS_ABORTED, FollowJointTrajectory.Result.INVALID_JOINTS),
                         (refused.status, refused.result.error_code))

    def test_a_skill_that_another_node_serves_is_done_fails_and_dies_by_name(self):
        door = subprocess.Popen([sys.executable, Path(__file__).with_name("door.py")], stdout=subprocess.PIPE)
        self.addCleanup(door.stdout.close)
        self.addCleanup(door.wait)
        self.addCleanup(door.kill)
        self.assertEqual(b"stands\n", door.stdout.readline())
        results = []
        for number in range(2):
            goal = self.execute(task(f"door-{number}", "open_door"))
            results.append(self.peer.done("a result", goal.get_result_async()).result)
        self.assertEqual(ExecuteTask.Result.SUCCEEDED, results[0].outcome, results[0].reason)
        self.assertEqual(ExecuteTask.Result.FAILED, results[1].outcome)
        self.assertIn("/door/open: not done: it is jammed", results[1].reason)
        goal = self.execute(task("door-2", "open_door"))
        self.assertEqual([b"asked\n"] * 3, [door.stdout.readline() for _ in range(3)])
        door.kill()
        gone = self.peer.done("a result", goal.get_result_async()).result
        self.assertEqual(ExecuteTask.Result.FAILED, gone.outcome)
        self.assertIn("/door/open: the server has gone, and what it was at is not known", gone.reason)
        goal = self.execute(task("door-3", "open_door"))
        gone = self.peer.done("a result", goal.get_result_async()).result
        self.assertIn("/door/open: no server within 5 s", gone.reason)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:], warnings="ignore")
