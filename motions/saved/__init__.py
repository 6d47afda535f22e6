"""Motions and plans as files: a timeline as JSON that a person can read, a plan as arrays."""
