"""Change numbers of the controller by a TOML file: it names what it overrides, nothing else.

An unknown key or a wrong type is an error that lists the valid ones. `go2-wbc demo
--config FILE` takes the same file.
"""

from pathlib import Path

from controller import GO2Controller
from go2_wbc.config import load_config
from go2_wbc.errors import ConfigError

file = Path("out/examples/mine.toml")
file.parent.mkdir(parents=True, exist_ok=True)
file.write_text(
    'backend = "full"  # the QP without elimination\n'
    "[wbc]\n"
    'solver = "proxqp"\n'
    "[locomotion]\n"
    "height = 0.26  # of the CoM while walking [m]\n"
    "[envelope]\n"
    "forward = 0.4  # m/s; what is faster is clipped\n",
    encoding="utf-8",
)
config = load_config(file)
print(f"back end {config.backend}, solver {config.wbc.solver}, height {config.locomotion.height} m")
with GO2Controller(config=file) as go2:
    go2.walk()
    go2.move(linear_x=0.35)
    go2.wait(2.0)
    height, speed = go2.state.p_world_base[2], go2.state.v[0]
    print(f"walks {height:.3f} m high at {speed:.2f} m/s")

wrong = file.with_name("wrong.toml")
wrong.write_text("[wbc]\nfricton = 0.5\n", encoding="utf-8")
try:
    load_config(wrong)
    refused = False
except ConfigError as error:
    refused = True
    print("refused:", str(error).split(": ", 1)[1])
if not refused or abs(height - 0.26) > 0.04 or abs(speed - 0.35) > 0.1:
    raise SystemExit("the file did not do what it says")
