"""The one robot description, its state, and everything computed from it in a tick."""
