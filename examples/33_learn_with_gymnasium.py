"""Try learners on the robot by Gymnasium: an environment, random actions, and a servo that stands.

Needs gymnasium: python -m pip install "go2-wbc[learning]". An action of 0 is the stance.
"""

from typing import Any

import numpy as np

try:
    import gymnasium
except ImportError:
    print('this example needs gymnasium: python -m pip install "go2-wbc[learning]"')
    raise SystemExit(0) from None

env = gymnasium.make("controller.learning:Go2-v0")
robot: Any = env.unwrapped
print(robot.layout.table())
rng, lasted = np.random.default_rng(0), dict[str, float]()

for name, spread in (("random", 1.0), ("standing", 0.0)):
    env.reset(seed=1, options={"command": (0.0, 0.0, 0.0)})
    gains: dict[str, float] = {}
    is_over = False
    while not is_over:
        action = spread * rng.uniform(-1.0, 1.0, 12)
        _, _, has_fallen, is_late, info = env.step(action.astype(np.float32))
        is_over = has_fallen or is_late
        for term, gain in info["reward_terms"].items():
            gains[term] = gains.get(term, 0.0) + gain
    lasted[name] = robot.plant.time
    worst = min(gains, key=lambda term: gains[term])
    print(f"{name}: {lasted[name]:.1f} s, reward {sum(gains.values()):.2f}, least by {worst}")

if not lasted["random"] < lasted["standing"] == 20.0:
    raise SystemExit(f"a robot that stands must not fall before the others: {lasted}")
