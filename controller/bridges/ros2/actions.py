"""The action that plays motions: goal, feedback with progress, cancel, result.

Goals are rare, so it has a node and an executor of its own, which sleep while there is none.
"""

from __future__ import annotations

import concurrent.futures
import logging
import threading
from typing import Any

from controller.bridges.ros2 import MOTION_ACTION
from controller.bridges.ros2 import imports as ros
from controller.bridges.ros2.behaviors import Jobs, motion_job
from controller.jobs import Job
from controller.modes import Outcome

_log = logging.getLogger(__name__)

THREADS = 3  #: One waits for the motion, the others serve cancels and further goals
FEEDBACK_PERIOD = 0.1  #: Time [s] between two messages of how far a motion has come


class MotionActions:
    """Offers ``play_motion`` of a job server's robot."""

    def __init__(self, context: Any, namespace: str, jobs: Jobs) -> None:
        """Offer the action of the robot ``namespace`` in ``context``."""
        self._jobs = jobs
        self._node = ros.Node(
            "go2_wbc_motions", namespace=namespace, context=context, start_parameter_services=False
        )
        self._server = ros.ActionServer(
            self._node,
            ros.PlayMotion,
            MOTION_ACTION,
            execute_callback=self._execute,
            callback_group=ros.ReentrantCallbackGroup(),
            goal_callback=self._judge,
            cancel_callback=lambda _handle: ros.CancelResponse.ACCEPT,
        )
        self._executor = ros.MultiThreadedExecutor(THREADS, context=context)
        self._executor.add_node(self._node)
        self._end = ros.Future()
        self._thread = threading.Thread(target=self._spin, name="go2-actions", daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            self._executor.spin_until_future_complete(self._end)
        except Exception as error:  # the robot goes on without the action
            _log.error("the action %s has ended: %s", MOTION_ACTION, error)

    def _judge(self, goal: Any) -> Any:
        refusal = self._jobs.refusal()
        if not refusal:
            return ros.GoalResponse.ACCEPT
        _log.warning("motion %r refused: %s", goal.motion, refusal)
        return ros.GoalResponse.REJECT

    def _execute(self, handle: Any) -> Any:
        goal, answered = handle.request, concurrent.futures.Future[Outcome]()
        go2, reply = self._jobs.robot, answered.set_result
        self._jobs.submit(motion_job(goal.motion, goal.settings, go2, reply))
        while not concurrent.futures.wait([answered], FEEDBACK_PERIOD).done:
            if handle.is_cancel_requested:  # again and again: one that came early gets lost
                self._jobs.cancel()
            if (job := self._jobs.job) is not None:
                handle.publish_feedback(self._feedback(job))
        return self._conclude(handle, answered.result())

    def _feedback(self, job: Job) -> Any:
        go2 = self._jobs.robot
        progress, elapsed = float(go2.progress), float(go2.state.time - job.start)
        return ros.PlayMotion.Feedback(phase=job.phase, progress=progress, elapsed=elapsed)

    def _conclude(self, handle: Any, answer: Outcome) -> Any:
        if answer.ok:
            handle.succeed()
        elif answer.cancelled and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return ros.PlayMotion.Result(
            success=answer.ok, message=answer.reason, duration=float(answer.duration)
        )

    def close(self) -> None:
        """Stop spinning and release the node; the jobs must have been answered before."""
        self._end.set_result(None)  # an executor that is shut down while it spins fails at times
        self._thread.join(2.0)
        self._executor.shutdown(timeout_sec=2.0)
        self._server.destroy()
        self._node.destroy_node()
