"""The library: one motion a file, named like the file."""
