"""Clone the trot: a small network learns by DAgger what the whole-body controller would do.

Without options it learns for seconds, too short to walk. `--rounds 10 --seconds 120` takes four
minutes on one core and made the policy that comes with the project. Needs the extra [policies].
"""

import argparse
import shutil
from pathlib import Path

from controller import GO2Controller, Mode
from controller.policies import TROT, Course, Sidecar, clone

try:
    import onnx  # noqa: F401
    import onnxruntime  # noqa: F401
except ImportError as error:
    print(f'this example needs a package ({error}): python -m pip install "go2-wbc[policies]"')
    raise SystemExit(0) from None

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--rounds", type=int, default=3, help="of trotting and fitting")
parser.add_argument("--seconds", type=float, default=10.0, help="of robot time in each")
parser.add_argument("--out", type=Path, default=Path("out/examples/trot.onnx"))
asked = parser.parse_args()

asked.out.parent.mkdir(parents=True, exist_ok=True)
meaning = asked.out.with_suffix(".toml")
shutil.copyfile(TROT.with_suffix(".toml"), meaning)
stayed_up = 0.0
for done in clone(Sidecar.load(meaning), Course(asked.rounds, asked.seconds)):
    stayed_up = done.stayed_up
    print(
        f"round {done.number}: the teacher moves the robot for {done.share:.0%} of the time, it is "
        f"up for {done.stayed_up:.1f} s; {done.samples} samples, {1000 * done.error:.0f} mrad off"
    )
    done.network.save(asked.out)

policy = asked.out if stayed_up > 10.0 else TROT
print("walks:", policy.name if policy is asked.out else "what a long course has made")
with GO2Controller() as go2:
    go2.walk(policy=policy)
    go2.move(linear_x=0.5)
    go2.wait(1.0)
    start = go2.state.p_world_base.copy()
    go2.wait(2.0)
    speed = float(((go2.state.p_world_base - start) ** 2).sum() ** 0.5) / 2.0
    print(f"told 0.5 m/s, the network walks at {speed:.2f} m/s")
    go2.walk()  # in its stride the whole-body controller takes over
    go2.wait(0.5)
    print(f"the whole-body controller walks on: {go2.mode.value}")
    if go2.mode is not Mode.WALKING or not 0.45 < speed < 0.55:
        raise SystemExit(f"it does not walk: {go2.last_outcome.reason}")
