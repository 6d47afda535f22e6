# Compiled and shipped without stubs: every name is untyped.
from typing import Any

def __getattr__(name: str) -> Any: ...
