"""The exam of the feasibility check: motions that authors write, and what physics made of them."""
