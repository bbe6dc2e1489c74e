"""The report: one self-contained HTML file, made from the nouns of a finished study."""

from .build import report_html
from .sweeps import sweep_html

__all__ = ["report_html", "sweep_html"]
