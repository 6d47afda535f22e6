"""MuJoCo as a plant: the model built from the URDF or a user's MJCF, and the plant that runs it."""
