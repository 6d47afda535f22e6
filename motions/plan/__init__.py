"""From a timeline to a plan: tracks, balance, solved spans, and the curves that are played."""
