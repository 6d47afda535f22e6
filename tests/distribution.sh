#!/usr/bin/env bash
# Builds the sdist and, from it, the wheel; installs each into an empty environment and uses it in an
# empty folder, as somebody does who has no checkout.
#
#   usage: tests/distribution.sh PYTHON      a Python that has `build`
set -euo pipefail
python=$(realpath --no-symlinks "$1")
cd "$(dirname "${BASH_SOURCE[0]}")/.."
here=$PWD
unset PYTHONPATH
export PIP_DISABLE_PIP_VERSION_CHECK=1

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
echo "== building"
"$python" -m build --outdir "$work/dist" . >"$work/build.log" 2>&1 || {
    cat "$work/build.log"
    exit 1
}
# The first Python block of the README, as it stands.
"$python" - README.md "$work/readme.py" <<'PYTHON'
import re
import sys
from pathlib import Path

block = re.search(r"^```python\n(.*?)^```$", Path(sys.argv[1]).read_text(), re.S | re.M)
Path(sys.argv[2]).write_text(block[1])
PYTHON

"$python" -m venv "$work/environment"
bin=$work/environment/bin
mkdir "$work/empty"
cd "$work/empty"

echo "== the wheel"
"$bin/pip" install --quiet "$work"/dist/*.whl
"$bin/python" -c "
import importlib.util as u, importlib.resources as r, go2_wbc, motions, viz, controller
assert go2_wbc.__version__, go2_wbc
for package in (go2_wbc, motions, viz, controller):
    assert r.files(package).joinpath('py.typed').is_file(), package
    [getattr(package, name) for name in package.__all__]
strangers = [name for name in ('benchmarks', 'examples', 'tests') if u.find_spec(name)]
assert not strangers, f'the wheel carries {strangers}'
"
"$bin/python" -W error::SyntaxWarning -c "$(cat "$work/readme.py")"
"$bin/go2-wbc" demo
test -s out/demo/demo.html
"$bin/high_five_demo" --no-media >/dev/null
"$bin/go2-wbc" check wave >/dev/null

echo "== learners: without the extra its name, with it an environment"
! "$bin/python" -c "from controller.learning import Go2Env" 2>"$work/missing"
grep -q 'go2-wbc\[learning\]' "$work/missing"
"$bin/pip" install --quiet "$(echo "$work"/dist/*.whl)[learning]"
"$bin/python" -c "import gymnasium; gymnasium.make('controller.learning:Go2-v0').reset(seed=0)"
! "$bin/python" -c "from controller.policies import TROT, Policy; Policy.load(TROT)" 2>"$work/missing"
grep -q 'go2-wbc\[policies\]' "$work/missing"
"$bin/pip" install --quiet "$(echo "$work"/dist/*.whl)[policies]"

echo "== tutorial, README and guides, as written"
(cd "$here" && GO2_WBC_USERS_BIN="$bin" "$python" -m pytest -n 2 -q tests/test_docs.py \
    -k "tutorial or runs_alone")

echo "== a user's script under strict type checkers: of the wheel, and of the checkout"
cp "$here/tests/user_script.py" .
echo '{"typeCheckingMode": "strict"}' >pyrightconfig.json
for environment in "$bin/python" "$python"; do
    "$python" -m mypy --strict --python-executable "$environment" user_script.py
    "$python" -m pyright --pythonpath "$environment" user_script.py
done

echo "== the sdist"
"$bin/pip" uninstall --quiet --yes go2-wbc
"$bin/pip" install --quiet "$work"/dist/*.tar.gz
"$bin/go2-wbc" doctor >/dev/null
"$bin/high_five_demo" --no-media >/dev/null
echo "== both work"
