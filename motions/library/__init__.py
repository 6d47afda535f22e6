"""The library: motions as users write theirs, by what they are about."""
