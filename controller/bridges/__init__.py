"""Bridges: other people's protocols in front of this controller; optional, imported lazily."""
