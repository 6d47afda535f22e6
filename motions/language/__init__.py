"""What an author can write: the calls of ``Timeline``, by what they are about."""
