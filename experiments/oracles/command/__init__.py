"""Any program as an oracle: files from templates, an argument list, a time limit, and numbers read from what it leaves.

The settings are data: they state the argument list openly, and nothing else is run. No shell, no evaluation.
"""

from .oracle import CommandOracle
from .parsers import GROUP, register_parser

__all__ = ["GROUP", "CommandOracle", "register_parser"]
