"""Call off a motion while it plays: it goes the way back that it knows, and the robot stands.

cancel() is for another thread; the call that plays then returns False and says why.
"""

import logging
import threading

from controller import GO2Controller

logging.getLogger("controller").addHandler(logging.NullHandler())  # the reason is printed below

with GO2Controller() as go2:
    go2.stand()
    result: list[bool] = []
    player = threading.Thread(target=lambda: result.append(go2.play("high_five")))
    player.start()
    while go2.progress < 0.4 and player.is_alive():  # the paw is up
        player.join(0.01)
    reached = go2.progress
    print(f"at {reached:.0%} of the motion feet in contact: {go2.state.feet_in_contact}")
    go2.cancel()
    player.join()
    done, reason = result[0], go2.last_outcome.reason
    feet = go2.state.feet_in_contact
    print(f"play() returned {done}: {reason}")
    print(f"now {go2.mode.value}, feet in contact: {feet}")
    again = go2.play("nod")
    print(f"ready for the next one: {again}")

if done or not (feet.all() and again):
    raise SystemExit("the motion was not called off safely")
