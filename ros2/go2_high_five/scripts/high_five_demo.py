#!/usr/bin/env python3
"""Stands, sits, walks, stops, gives a high five and sits, over ROS 2."""

import sys
import time

import rclpy
from go2_high_five.controller import GO2Controller


def main() -> int:
    """Run the sequence on robot1; the exit code is 1 if something was not done."""
    rclpy.init()
    robot = GO2Controller("robot1")
    try:
        done = [robot.stand(), robot.sit(), robot.walk()]
        robot.move(linear_x=0.2)
        time.sleep(2.0)
        robot.stop()
        time.sleep(1.0)
        done += [robot.high_five(), robot.sit()]
    except KeyboardInterrupt:
        return 130
    finally:
        robot.destroy_node()
        rclpy.try_shutdown()
    print(f"{sum(done)} of {len(done)} behaviours done")
    return 0 if all(done) else 1


if __name__ == "__main__":
    sys.exit(main())
