"""FMI 2.0 and 3.0 units for co-simulation, with the exported C inside."""

from .targets import FMI2, FMI3

__all__ = ["FMI2", "FMI3"]
