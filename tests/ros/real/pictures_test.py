#!/usr/bin/env python3
"""The cameras of a cell at work, by the clock, as real nodes of ROS 2 see them: each picture is more than a megabyte.

usage: pictures_test.py PONS     run by .venv-ros's interpreter (make ros-peers)"""

import sys
import unittest

from rclpy.qos import QoSProfile, qos_profile_sensor_data

import kit

PONS = kit.pons_program()


class Pictures(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.run_ = kit.Run(PONS, "parcel_cell", "--parcels", "1000")
        cls.addClassCleanup(cls.run_.end)

    def setUp(self):
        self.peer = kit.Peer(self.run_)
        self.addCleanup(self.peer.close)

    def expect_pictures(self, qos: QoSProfile, topic: str, told: str, encoding: str, bytes_a_pixel: int):
        pictures = self.peer.hear("sensor_msgs/msg/Image", topic, qos)
        infos = self.peer.hear("sensor_msgs/msg/CameraInfo", told)
        self.peer.until(f"pictures at {topic}", lambda: len(pictures) >= 30)
        last = pictures[-1]
        self.assertEqual((encoding, last.width * last.height * bytes_a_pixel), (last.encoding, len(last.data)))
        stamps = [kit.seconds(each.header.stamp) for each in pictures]
        self.assertEqual(stamps, sorted(set(stamps)))
        taken = {stamp for each in infos if stamps[0] <= (stamp := kit.seconds(each.header.stamp)) <= stamps[-1]}
        self.assertGreaterEqual(len(taken), 25)
        # A reader that is kept from its CPU for a millisecond or two loses a piece, and with it a picture.
        self.assertGreaterEqual(len(stamps), 0.8 * len(taken), f"{topic}: {len(stamps)} of {len(taken)}")

    def test_a_reader_that_asks_for_best_effort_has_them(self):
        self.expect_pictures(qos_profile_sensor_data, "/overhead/image_raw", "/overhead/camera_info", "rgb8", 3)

    def test_a_reader_that_asks_for_depth_as_best_effort_has_it(self):
        self.expect_pictures(qos_profile_sensor_data, "/overhead/depth/image_rect_raw", "/overhead/depth/camera_info",
                             "32FC1", 4)

    def test_a_reader_that_asks_for_reliability_has_them(self):
        self.expect_pictures(QoSProfile(depth=10), "/overhead/image_raw", "/overhead/camera_info", "rgb8", 3)

    def test_compressed_ones_are_jpeg(self):
        pictures = self.peer.hear("sensor_msgs/msg/CompressedImage", "/overhead/image_raw/compressed",
                                  qos_profile_sensor_data)
        self.peer.until("pictures", lambda: len(pictures) > 5)
        self.assertIn("jpeg", pictures[0].format)
        self.assertEqual(b"\xff\xd8", bytes(pictures[0].data[:2]))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:], warnings="ignore")
