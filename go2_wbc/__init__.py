"""The engine: whole-body control of the Unitree Go2."""
