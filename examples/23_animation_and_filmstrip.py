"""Pictures of a run without a display, a GPU or ffmpeg: an animation and a row of stills.

Both are drawn in software from the recording, after the run.
"""

from pathlib import Path

from PIL import Image

from controller import GO2Controller
from viz import export_animation, export_filmstrip

FOLDER = Path("out/examples")

with GO2Controller() as go2:
    go2.stand()
    go2.play("bow")
    go2.sit()
    recording = go2.recording(rate=50.0)

film = export_animation(recording, FOLDER / "run.webp", speed=3.0, fps=10, size=(400, 260))
stills = export_filmstrip(recording, FOLDER / "run.png", times=[0.0, 3.0, recording.duration])
with Image.open(film) as image:
    frames = getattr(image, "n_frames", 1)
    print(
        f"{FOLDER / film.name}: {frames} pictures of {image.size} px for {recording.duration:.1f} s"
    )
with Image.open(stills) as image:
    print(f"{FOLDER / stills.name}: three moments in {image.size} px")
if frames < 10:
    raise SystemExit("the animation does not move")
