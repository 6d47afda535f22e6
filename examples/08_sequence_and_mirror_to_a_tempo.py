"""Put motions together: in sequence, mirrored, at the same time, and to a tempo.

After bpm() times are beats. then() joins motions, mirror() exchanges left and right, together()
plays several at once if they move different things.
"""

from controller import GO2Controller
from motions import Timeline, check, deg, load_motion

TEMPO = 90.0  # beats per minute

swing = Timeline().bpm(TEMPO).body(yaw=deg(8), over=1).body(yaw=0.0, over=1)
dip = Timeline().bpm(TEMPO).body(z=-0.04, over=1).body(z=0.0, over=1)
step = Timeline().together(swing, dip)  # two beats: turn and dip
dance = Timeline(name="dance").then(step, step.mirror(), load_motion("nod", times=1)).repeat(2)

report = check(dance)
print(report.summary())
with GO2Controller() as go2:
    go2.stand()
    done = go2.play(dance)
    run = go2.recording()

yaw = [
    2.0 * (q[6] * q[5] + q[3] * q[4])
    for q, what in zip(run.q, run.labels, strict=True)
    if what == "dance"
]
print(f"danced {dance.end:.1f} s: {done}; yaw from {min(yaw):+.2f} to {max(yaw):+.2f} rad")
if not (done and max(yaw) > 0.1 and min(yaw) < -0.1):
    raise SystemExit("the dance was not done to both sides")
