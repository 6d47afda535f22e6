#!/usr/bin/env bash
# Makes environments with Unitree's Python SDK, for the tests: one on CycloneDDS 11 from PyPI, and, if
# Debian's package of CycloneDDS 0.10.2 is there, one on that, which is what the robot itself speaks.
#
#   usage: make_stock.sh PYTHON FOLDER      makes FOLDER/stock and, if it can, FOLDER/stock-old
set -euo pipefail
python=$1
folder=$2
sdk=unitree-sdk2py-dimos==1.0.3

"$python" -m venv --clear "$folder/stock"
"$folder/stock/bin/python" -m pip install --quiet cyclonedds==11.0.1 "$sdk"

header=/usr/include/dds/dds.h
if [[ ! -f $header ]]; then
    echo "The SDK on the robot's own CycloneDDS is not tested: apt-get install cyclonedds-dev"
    exit
fi
if "$python" -c 'import sys; sys.exit(sys.version_info < (3, 13))'; then
    echo "The SDK on the robot's own CycloneDDS is not tested: 0.10.2 knows Python up to 3.12"
    exit
fi
library=$(dirname "$(find /usr/lib -name libddsc.so | head -n 1)")
home=$(mktemp -d)
trap 'rm -rf "$home"' EXIT
mkdir "$home/bin"
ln -s /usr/include "$home/include"
ln -s "$library" "$home/lib"
"$python" -m venv --clear "$folder/stock-old"
pip=("$folder/stock-old/bin/python" -m pip install --quiet)
"${pip[@]}" setuptools wheel numpy rich-click
CYCLONEDDS_HOME=$home "${pip[@]}" --no-deps --no-build-isolation cyclonedds==0.10.2
"${pip[@]}" --no-deps "$sdk"
