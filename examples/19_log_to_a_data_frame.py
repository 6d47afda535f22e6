"""Turn a run into a pandas table and ask it questions.

Needs pandas (`pip install pandas`). recording() holds arrays of the last minutes, one row a sample.
"""

from pathlib import Path

from controller import GO2Controller
from go2_wbc.legs import JOINT_NAMES, LEGS

try:
    import pandas as pd
except ImportError:
    print("this example needs pandas: python -m pip install pandas")
    raise SystemExit(0) from None

with GO2Controller() as go2:
    go2.stand()
    go2.walk()
    go2.move(linear_x=0.5)
    go2.wait(2.0)
    go2.stop()
    go2.sit()
    run = go2.recording()

joints = [name.removesuffix("_joint") for name in JOINT_NAMES]
frame = pd.DataFrame(run.tau, columns=[f"{joint} [N m]" for joint in joints])
frame.insert(0, "time", run.time)
frame.insert(1, "doing", run.labels)
frame.insert(2, "forward [m/s]", run.v[:, 0])
for leg in LEGS:
    frame[f"{leg.name} [N]"] = run.foot_forces[:, leg]

file = Path("out/examples/run.csv")
file.parent.mkdir(parents=True, exist_ok=True)
frame.to_csv(file, index=False)
table = frame.groupby("doing", sort=False).agg(
    samples=("time", "size"),
    fastest=("forward [m/s]", "max"),
    calf=("RL_calf [N m]", lambda tau: tau.abs().max()),
)
print(table.round(2).to_string())
print(f"{len(frame)} rows, {len(frame.columns)} columns in {file}")
if run.v[:, 0].max() < 0.45:
    raise SystemExit("the walk is not in the table")
