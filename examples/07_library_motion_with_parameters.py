"""Play a motion of the library with parameters of its own, and see what there are.

Every parameter has a default and a valid set; a wrong value is refused with that set.
"""

from controller import GO2Controller
from go2_wbc.errors import Go2WbcError
from motions import find_motion, load_motion, motion_names

print(len(motion_names()), "motions:", ", ".join(motion_names()))
wave = find_motion("wave")
print(f"{wave.name}: {wave.summary}")
for parameter in wave.parameters:
    print(" ", parameter)

try:
    load_motion("wave", times=99)
except Go2WbcError as error:
    print("refused:", error)

with GO2Controller() as go2:
    go2.stand()
    done = go2.play(load_motion("wave", side="left", times=2))
    print(f"waved twice with the left paw: {done}, in {go2.last_outcome.duration:.1f} s")

if not done:
    raise SystemExit(go2.last_outcome.reason)
