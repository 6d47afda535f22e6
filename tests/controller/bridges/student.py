"""A class as a student of the course writes it: plain rclpy, one service client, one publisher."""

import rclpy
from geometry_msgs.msg import Twist
from quadropted_msgs.srv import RobotBehaviorCommand
from rclpy.node import Node

PATIENCE = 5.0


class StudentController(Node):
    """Knows nothing of this project."""

    def __init__(self, namespace: str = "robot1") -> None:
        super().__init__("student_controller")
        self._namespace = namespace
        self._client = self.create_client(
            RobotBehaviorCommand, f"/{namespace}/robot_behavior_command"
        )
        self._velocity = self.create_publisher(Twist, f"/{namespace}/cmd_vel", 10)
        self._wait_for_service()

    def _wait_for_service(self, timeout_sec: float = PATIENCE) -> bool:
        return self._client.wait_for_service(timeout_sec)

    def _call_behavior(self, command: str) -> bool:
        request = RobotBehaviorCommand.Request()
        request.command = command
        future = self._client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=PATIENCE)
        return future.done() and future.result().success

    def sit(self) -> bool:
        return self._call_behavior("sit")

    def stand(self) -> bool:
        return self._call_behavior("up")

    def walk(self) -> bool:
        return self._call_behavior("walk")

    def move(self, linear_x: float = 0.0, angular_z: float = 0.0) -> None:
        message = Twist()
        message.linear.x, message.angular.z = linear_x, angular_z
        self._velocity.publish(message)

    def stop(self) -> None:
        self.move()
