"""Learning from the controller."""
