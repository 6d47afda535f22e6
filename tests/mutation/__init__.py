"""Mutation testing: does some test fail when one small thing in the code is wrong?

DeMillo, Lipton & Sayward, *Hints on test data selection*, IEEE Computer 11(4), 1978. Run by hand,
outside CI: ``python -m tests.mutation --n 120 --seed 1``.
"""
