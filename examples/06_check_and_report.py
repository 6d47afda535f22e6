"""Ask whether the robot can do a motion before anything moves, and read the report.

check() works out joint angles, torques and contact forces at every instant and holds them against
every limit; nothing is simulated. The findings say what to change.
"""

from motions import Timeline, check, deg


def bow(angle: float, depth: float) -> Timeline:
    """Bow by ``angle`` [deg], ``depth`` [m] down."""
    line = Timeline(name=f"bow of {angle:.0f} deg").body(pitch=deg(angle), z=-depth, over=0.8)
    return line.hold(0.3).home(over=0.8)


too_deep = check(bow(30.0, depth=0.12))
print(too_deep.summary())
for finding in too_deep.failures:
    print(f"  {finding}; {-finding.margin:.3f} {finding.unit} too much")

mended = check(bow(25.0, depth=0.06))
print(mended.table())
tightest = mended.margins["joint position"]
print(f"left to the calves' limit: {tightest.margin:.2f} {tightest.unit} at {tightest.time:.1f} s")

if too_deep.ok or not mended.ok:
    raise SystemExit("the check did not tell the two apart")
