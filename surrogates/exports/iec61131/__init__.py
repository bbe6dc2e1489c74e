"""Function blocks in structured text, IEC 61131-3, for programmable logic controllers."""

from .target import StructuredText

__all__ = ["StructuredText"]
