#!/usr/bin/env python3
"""A door that other nodes open: std_srvs/Trigger at /door/open. The second time it is jammed, the third time it never
answers. It says when it stands, and each time it is asked."""

import threading

import rclpy
from std_srvs.srv import Trigger


def main():
    asked = []

    def open_door(_, response):
        asked.append(True)
        print("asked", flush=True)
        if len(asked) == 3:
            threading.Event().wait()
        response.success = len(asked) != 2
        response.message = "open" if response.success else "it is jammed"
        return response

    rclpy.init()
    node = rclpy.create_node("door")
    node.create_service(Trigger, "/door/open", open_door)
    print("stands", flush=True)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
