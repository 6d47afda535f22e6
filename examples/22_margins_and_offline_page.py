"""Look at a motion before it is played: a plot of its margins, and a 3D page that needs no network.

The same as `go2-wbc preview wave --html wave.html --plot wave.svg`, in a program.
"""

from pathlib import Path

from controller.report_view import planned, verdict_of
from motions import FeasibilityChecker, load_motion
from viz import export_html, export_plot

FOLDER = Path("out/examples")

checked = FeasibilityChecker().evaluate(load_motion("wave", times=2))
verdict = verdict_of(checked.report)
page = export_html(planned(checked), FOLDER / "wave.html", title="Wave")
print("limits, the tightest first:")
for curve in verdict.ranked()[:5]:
    print(f"  {curve.name:16} least margin {curve.least:.3g} {curve.unit}")
plot = export_plot(verdict, FOLDER / "wave.svg", title="Wave")

for file in (page, plot):
    print(f"wrote {FOLDER / file.name}: {file.stat().st_size / 1000:.0f} kB")
if not verdict.ok:
    raise SystemExit("the motion is not feasible")
