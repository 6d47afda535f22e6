"""Behaviours: each turns the snapshot of a tick into what to track now."""
