#!/usr/bin/env python3
"""A base by the clock beside real nodes of ROS 2, which steer it and send it about.

usage: rounds_test.py PONS     run by .venv-ros's interpreter (make ros-peers)"""

import math
import sys
import unittest

from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, Twist
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient
from rclpy.clock import Clock
from rclpy.qos import qos_profile_sensor_data

import kit

PONS = kit.pons_program()


def on_map(x: float, y: float, frame: str = "map") -> PoseStamped:
    goal = PoseStamped()
    goal.header.frame_id = frame
    goal.pose.position.x, goal.pose.position.y, goal.pose.orientation.w = x, y, 1.0
    return goal


class Rounds(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.run_ = kit.Run(PONS, "rounds", "--stay")
        cls.addClassCleanup(cls.run_.end)

    def setUp(self):
        self.peer = kit.Peer(self.run_)
        self.addCleanup(self.peer.close)
        self.odometry = self.peer.hear("nav_msgs/msg/Odometry", "/odom")
        self.poses = self.peer.hear("geometry_msgs/msg/PoseWithCovarianceStamped", "/pons/pose")
        self.peer.until("odometry and a pose", lambda: self.odometry and self.poses)

    def speed(self) -> float:
        return math.hypot(self.odometry[-1].twist.twist.linear.x, self.odometry[-1].twist.twist.angular.z)

    def at(self) -> tuple[float, float]:
        """Where it believes to be, m on the map."""
        return self.poses[-1].pose.pose.position.x, self.poses[-1].pose.pose.position.y

    def until_it_stands(self):
        self.peer.until("standstill", lambda: self.speed() < 0.005)

    def until_it_is_near(self, x: float, y: float):
        self.peer.until(f"it is at {x}, {y}", lambda: math.dist(self.at(), (x, y)) < 0.1 and self.speed() < 0.005)

    def test_what_it_shows_is_what_its_lidar_and_its_map_say(self):
        scans = self.peer.hear("sensor_msgs/msg/LaserScan", "/scan", qos_profile_sensor_data)
        maps = self.peer.hear("nav_msgs/msg/OccupancyGrid", "/map", kit.LATCHED)
        self.peer.until("scans and a map", lambda: len(scans) > 10 and maps)
        self.assertEqual(("lidar", 360), (scans[-1].header.frame_id, len(scans[-1].ranges)))
        self.assertEqual(maps[0].info.width * maps[0].info.height, len(maps[0].data))
        self.assertLessEqual({0, 100}, set(maps[0].data))
        stamps = [kit.seconds(each.header.stamp) for each in scans]
        self.assertAlmostEqual(0.1, (stamps[-1] - stamps[0]) / (len(stamps) - 1), delta=0.03)
        self.assertEqual(("odom", "base_link"), (self.odometry[-1].header.frame_id, self.odometry[-1].child_frame_id))

    def test_cmd_vel_steers_it_and_silence_stops_it(self):
        publisher = self.peer.node.create_publisher(Twist, "/cmd_vel", 10)
        self.peer.until("a reader of /cmd_vel", publisher.get_subscription_count)
        for ahead_m_s in (0.2, -0.2):
            with self.subTest(ahead_m_s=ahead_m_s):
                message = Twist()
                message.linear.x = ahead_m_s
                timer = self.peer.node.create_timer(0.05, lambda: publisher.publish(message), clock=Clock())
                self.peer.until("its speed", lambda: abs(self.odometry[-1].twist.twist.linear.x - ahead_m_s) < 0.03)
                timer.cancel()
                self.until_it_stands()

    def test_goal_pose_moves_it(self):
        publisher = self.peer.node.create_publisher(PoseStamped, "/goal_pose", 10)
        self.peer.until("a reader of /goal_pose", publisher.get_subscription_count)
        publisher.publish(on_map(1.0, 0.0))
        self.until_it_is_near(1.0, 0.0)
        log = self.peer.hear("rcl_interfaces/msg/Log", "/rosout")
        publisher.publish(on_map(1.0, 0.0, "odom"))
        self.peer.until("a refusal", lambda: [each for each in log if "the goal's frame is 'odom'" in each.msg])

    def navigate(self, goal: PoseStamped, heard: list | None = None):
        client = ActionClient(self.peer.node, NavigateToPose, "/navigate_to_pose")
        self.peer.until("/navigate_to_pose is served", client.server_is_ready)
        keep = None if heard is None else lambda message: heard.append(message.feedback)
        sent = client.send_goal_async(NavigateToPose.Goal(pose=goal), feedback_callback=keep)
        handle = self.peer.done("acceptance", sent)
        self.assertTrue(handle.accepted)
        return handle

    def test_navigate_to_pose_brings_it_there(self):
        heard = []
        result = self.peer.done("a result", self.navigate(on_map(0.0, 0.5), heard).get_result_async())
        self.assertEqual((GoalStatus.STATUS_SUCCEEDED, 0), (result.status, result.result.error_code),
                         result.result.error_msg)
        self.assertGreater(len(heard), 5)
        self.assertLess(heard[-1].distance_remaining, heard[0].distance_remaining)
        self.until_it_is_near(0.0, 0.5)

    def test_navigate_to_pose_is_cancelled_replaced_and_aborted(self):
        heard = []
        goal = self.navigate(on_map(5.6, 0.0), heard)
        self.peer.until("feedback", lambda: heard)
        self.assertEqual(1, len(self.peer.done("an answer", goal.cancel_goal_async()).goals_canceling))
        self.assertEqual(GoalStatus.STATUS_CANCELED, self.peer.done("a result", goal.get_result_async()).status)
        self.until_it_stands()
        replaced = self.navigate(on_map(5.6, 0.0))
        result = self.peer.done("a result", self.navigate(on_map(0.0, 0.0)).get_result_async())
        self.assertEqual(GoalStatus.STATUS_SUCCEEDED, result.status, result.result.error_msg)
        self.assertEqual(GoalStatus.STATUS_ABORTED, self.peer.done("a result", replaced.get_result_async()).status)
        lost = self.peer.done("a result", self.navigate(on_map(0.0, 0.0, "odom")).get_result_async())
        self.assertEqual((GoalStatus.STATUS_ABORTED, 9002), (lost.status, lost.result.error_code),
                         lost.result.error_msg)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:], warnings="ignore")
