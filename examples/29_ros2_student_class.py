"""Drive the robot over ROS 2 with a class that knows nothing of this project, plain rclpy.

Needs the extra [ros2] and the interfaces of docs/ros2.md. It starts the server, `go2-wbc ros2`.
"""

import os
import subprocess
import sys
import time

try:
    import rclpy
    from geometry_msgs.msg import Twist
    from quadropted_msgs.srv import RobotBehaviorCommand
    from rclpy.node import Node
except ImportError as error:
    print(f"this example needs ROS 2 ({error}): see docs/ros2.md")
    raise SystemExit(0) from None


class Student(Node):
    """One service client and one publisher, as in a course."""

    def __init__(self, robot: str) -> None:
        super().__init__("student")
        self._client = self.create_client(RobotBehaviorCommand, f"/{robot}/robot_behavior_command")
        self._velocity = self.create_publisher(Twist, f"/{robot}/cmd_vel", 10)
        if not self._client.wait_for_service(30.0):
            raise SystemExit("no server")

    def behave(self, command: str) -> bool:
        """Ask for ``command``; the answer comes when it is done."""
        future = self._client.call_async(RobotBehaviorCommand.Request(command=command))
        rclpy.spin_until_future_complete(self, future, timeout_sec=300.0)
        answer = future.result() or RobotBehaviorCommand.Response(message="no answer")
        print(f"{command}: {answer.success}, {answer.message}")
        return answer.success

    def move(self, speed: float) -> None:
        """Walk at ``speed`` [m/s] for two seconds; half a second of silence would end it."""
        message = Twist()
        message.linear.x = speed
        for _ in range(20):
            self._velocity.publish(message)
            time.sleep(0.1)


os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
server = subprocess.Popen([sys.executable, "-m", "controller.cli.main", "ros2"])  # serves robot1
try:
    rclpy.init()
    student = Student("robot1")
    done = student.behave("up") and student.behave("walk")
    student.move(0.2)
    done = done and student.behave("high_five") and student.behave("sit")
finally:
    server.terminate()
    server.wait(20.0)
    rclpy.try_shutdown()
raise SystemExit(0 if done else "something was not done")
