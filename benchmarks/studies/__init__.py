"""Studies behind single pages of the documentation, kept so that they can be repeated."""
