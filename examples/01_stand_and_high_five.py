"""The first program: a simulated Go2 stands up, gives a high five, and sits down.

Every call returns True only if the measured state shows that the thing was done.
"""

from controller import GO2Controller

with GO2Controller() as go2:  # a Go2 in MuJoCo, headless, as fast as the CPU allows
    stood = go2.stand()
    greeted = go2.high_five(side="right", hold=1.0)
    paw = go2.last_outcome.measured["mean paw height [m]"]
    sat = go2.sit()
    print(f"stood up: {stood}")
    print(f"high five: {greeted}, with the paw held {paw:.2f} m high")
    print(f"sat down: {sat}, after {go2.state.time:.1f} s of robot time")

if not (stood and greeted and sat):
    raise SystemExit("something was not done")
