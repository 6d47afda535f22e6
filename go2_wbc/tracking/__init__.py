"""From a motion plan to the reference of a tick: sampled, placed in the world, and followed."""
