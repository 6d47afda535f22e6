"""Compiled kernels: the arithmetic of one tick, in fixed-size loops.

A kernel holds no number and no idea of its own. What it computes is described where people read it
(``robot.snapshot``, ``wbc.tasks``, ``wbc.constraints``, ``wbc.backends``), its numbers come from
those descriptions, and the tests hold it to them. Kernels take and fill float64 arrays; how a
compiled kernel is kept between runs says ``compilation``.
"""
