"""What ``go2-wbc demo --ros2`` does: the demo on a robot that another process serves."""

from __future__ import annotations

import argparse
import sys

from controller.bridges.ros2.demo import STEPS, run_ros_demo
from controller.cli.common import ExitCode, print_json
from controller.cli.demo_table import render_steps
from controller.cli.progress import ProgressLine
from controller.demo.report import DemoReport, StepResult


def run_ros_demo_command(args: argparse.Namespace) -> int:
    """Run the demo, print the steps."""
    with ProgressLine(sys.stderr) as line:
        done: list[StepResult] = []

        def show(result: StepResult) -> None:
            done.append(result)
            verdict = "ok" if result.ok else f"NOT DONE: {result.reason}"
            line.done(f"{len(done)}/{len(STEPS)} {result.label}: {verdict}")

        results = run_ros_demo(args.namespace, show)
    ok = all(step.ok for step in results)
    if args.json:
        print_json({"ok": ok, "steps": DemoReport.steps_as_dicts(results)})
    else:
        print(render_steps(results, sys.stdout.encoding))
        print(f"{sum(step.ok for step in results)} of {len(results)} steps borne out by odometry.")
    return ExitCode.OK if ok else ExitCode.FAILED
