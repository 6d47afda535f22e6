"""``go2-wbc identify-friction``: what friction the joints have, for the configuration file."""

from __future__ import annotations

from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from controller.cli.common import ExitCode, Json, dds_domain, output, print_json
from controller.cli.progress import ProgressLine
from go2_wbc.errors import CommandError

if TYPE_CHECKING:
    from go2_wbc.plant.base import Plant
    from go2_wbc.plant.friction_identification import FrictionEstimate


def run(
    *,
    mjcf: Annotated[Path | None, "FILE", "an MJCF of your own"] = None,
    interface: Annotated[str | None, "NAME", "lo for a simulator"] = None,
    domain: Annotated[int, "N", "0 robot, 1 simulator", dds_domain] = 0,
    i_have_the_remote_in_hand: Annotated[bool, "required with --interface"] = False,
    out: Annotated[Path | None, "FILE", "write the TOML there, too", output(".toml")] = None,
    json: Json = False,
) -> int:
    """Move every joint of a robot that lies on its belly, legs over its back, for a minute.

    It prints the friction of the joints for the configuration file. With --interface that of a Go2,
    or go2-wbc unitree-sim: read docs/real_robot.md first, and leave half a metre around it.

    Examples:
        go2-wbc identify-friction     of the simulated robot
        go2-wbc identify-friction --mjcf my_go2.xml --out friction.toml
        go2-wbc identify-friction --interface eth0 --i-have-the-remote-in-hand
    """
    from go2_wbc.plant.friction_identification import identify_friction

    if mjcf is not None and interface is not None:
        raise CommandError("give --mjcf or --interface, not both")
    if interface is None:
        from go2_wbc.plant import MujocoPlant

        plant: Plant = MujocoPlant(mjcf)
    else:
        from controller.bridges.unitree.plant import UnitreePlant

        consent = i_have_the_remote_in_hand
        plant = UnitreePlant(interface, domain, i_have_the_remote_in_hand=consent)
    with ProgressLine() as line, closing(plant):
        estimate = identify_friction(
            plant, on_progress=lambda share: line.update(share, "identify friction")
        )
    if out is not None:
        out.write_text(estimate.toml(), encoding="utf-8")
    if json:
        print_json({name: values.tolist() for name, values in asdict(estimate).items()})
    else:
        _print(estimate)
    return ExitCode.OK


def _print(estimate: FrictionEstimate) -> None:
    from go2_wbc.legs import JOINT_NAMES

    print("# joint      dry [N m]          viscous [N m s/rad], measured")
    rows = zip(
        JOINT_NAMES,
        estimate.dry,
        estimate.dry_error,
        estimate.viscous,
        estimate.viscous_error,
        strict=True,
    )
    for name, dry, dry_error, viscous, viscous_error in rows:
        joint = name.removesuffix("_joint")
        print(f"# {joint:<10}{dry:7.3f} +- {dry_error:.3f}   {viscous:7.3f} +- {viscous_error:.3f}")
    print("# of the viscous friction 75 % is fed forward, less what is uncertain")
    print(estimate.toml(), end="")
