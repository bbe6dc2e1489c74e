"""C99 for a controller: a header, a source file and a program that tests them. No heap, no globals, no recursion."""

from .target import C99, C99Float

__all__ = ["C99", "C99Float"]
