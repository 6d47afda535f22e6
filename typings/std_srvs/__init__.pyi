# Compiled and untyped, and here only with the extra [ros2]: every name is untyped.
from typing import Any

def __getattr__(name: str) -> Any: ...
