#!/usr/bin/env bash
# Runs the tests of the ROS 2 bridge in an environment of their own, .venv-ros2, on the loopback:
# builds the interfaces there (once), installs the extra, then calls pytest.
#
#   usage: ros2/test.sh [PYTEST ARGUMENTS]
#   PYTHON=python3.12   with another Python;   ROS=jazzy   with the other distribution
#   WORKERS=1           processes that run tests (2)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

python=${PYTHON:-python3}
distribution=${ROS:-kilted}
venv=.venv-ros2
extra=ros2
if [[ $distribution != kilted ]]; then
    venv=.venv-ros2-$distribution
    extra=ros2-$distribution
fi
unset LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE AMENT_PREFIX_PATH CMAKE_PREFIX_PATH PYTHONPATH

# The stamp holds what the environment was made from.
stamp=$venv/.stamp
made_from=$(cat pyproject.toml ros2/*requirements*.txt ros2/*.sh ros2/*.py \
    ros2/*_msgs/package.xml ros2/*_msgs/*/* | cksum)
if [[ ! -f $stamp || $(cat "$stamp") != "$made_from" ]]; then
    echo "== making $venv (the first time it fetches about 450 MB)"
    "$python" -m venv --clear "$venv"
    ROS=$distribution ros2/build_interfaces.sh "$venv/bin/python" "$venv/interfaces"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check \
        --editable ".[test,$extra]" "$venv"/interfaces/*.whl -r ros2/test-requirements.txt
    echo "$made_from" >"$stamp"
fi
GO2_WBC_REQUIRE_ROS2=1 exec "$venv/bin/python" -m pytest tests/controller/bridges \
    'tests/test_examples.py::test_an_example_runs_and_prints_its_point[29_ros2_student_class]' \
    --ignore=tests/controller/bridges/unitree -n "${WORKERS:-2}" --dist loadfile "$@"
