# Ships a stub whose types are names of C++ classes: every name is untyped here.
from typing import Any

def __getattr__(name: str) -> Any: ...
