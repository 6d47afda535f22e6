"""The exam of the feasibility check, mirrored."""
