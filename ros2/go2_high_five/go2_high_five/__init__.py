"""A Go2 behind one class."""
