"""Arithmetic that the rooms above share: vectors, small linear systems, quadratic programs."""
