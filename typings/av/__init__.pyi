# Optional, so absent where the gates may run: every name is untyped.
from typing import Any

def __getattr__(name: str) -> Any: ...
