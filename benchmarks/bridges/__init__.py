"""Benchmarks of the bridges: other people's protocols between real processes on the loopback."""
