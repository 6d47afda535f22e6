"""Doors to other middleware: optional, each behind an extra of its own."""
