"""What an executor costs per point, and how two workers scale, beside peers that store nothing."""

from .table import table

__all__ = ["table"]
