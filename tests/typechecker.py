"""The check of every argument under pytest: as types say it, a whole number is a number too."""

from __future__ import annotations

from beartype import BeartypeConf, beartype

checked = beartype(conf=BeartypeConf(is_pep484_tower=True))
"""Decorator of each function of the modules that ``conftest.py`` names."""
