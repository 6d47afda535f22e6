"""Bridges to other middleware: optional, each with an extra of its own."""
