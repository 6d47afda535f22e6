"""From a velocity command to a reference."""
