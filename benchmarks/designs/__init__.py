"""Designs: what can be constructed, and how low uniform designs come in a given time, beside peers in one run."""


def table(seconds: float = 2.0) -> str:
    """All tables of designs; `seconds` are what each best published value is given (the aim allows 30)."""
    from . import constructions, discrepancy_by_time, published  # each is a program of its own, too

    return "\n".join([constructions.table(), discrepancy_by_time.table(), published.table(seconds)])
