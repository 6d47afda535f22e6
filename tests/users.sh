#!/usr/bin/env bash
# What users are shown, in the two environments that they have: README, tutorial, guides, examples and
# notebooks, from a clone after `make demo` alone, and on the wheel with the extras that they name.
#
#   usage: tests/users.sh PYTHON      a Python with the test tools, and `build`
set -euo pipefail
python=$(realpath --no-symlinks "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/.."
unset PYTHONPATH
export PIP_DISABLE_PIP_VERSION_CHECK=1

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# All that is shown runs in the environment with this folder of programs; $2 chooses.
shown_runs() {
    GO2_WBC_USERS_BIN="$1" "$python" -m pytest -n 2 -q -rs -k "$2" \
        tests/test_docs.py tests/test_examples.py tests/test_notebooks.py
}

echo "== a clone, after make demo"
git clone --quiet . "$work/clone"
make -C "$work/clone" demo >"$work/demo.log" 2>&1 || { cat "$work/demo.log"; exit 1; }
shown_runs "$work/clone/.venv/bin" "tutorial or runs_alone or prints_its_point"

echo "== the wheel, with the extras that examples and notebooks name"
"$python" -m build --wheel --outdir "$work/dist" . >"$work/build.log" 2>&1 || { cat "$work/build.log"; exit 1; }
"$python" -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet "$(echo "$work"/dist/*.whl)[examples,notebooks,dynamics,learning,music,policies,unitree]"
shown_runs "$work/environment/bin" "tutorial or runs_alone or prints_its_point or clean_kernel"
echo "== all of it works in both"
