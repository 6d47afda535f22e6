"""The exam of the feasibility check: motions that authors write, and what physics makes of them."""
