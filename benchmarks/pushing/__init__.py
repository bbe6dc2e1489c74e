"""How far a range can be pushed before the stress, the error or the certificate stops it.

All factors are widened together. At every range the same coded designs are run anew, models of every degree are fitted
to them and held against the same fresh coded points. Between the last range that holds and the first that does not,
the range is bisected.

Modules
-------
cases
    The mechanisms, what is widened, and the stress.
campaigns
    Runs, models, errors and certificates at a range.
limits
    The range at which something stops.
family
    Other HexFlexes with the same linear map: what is open about the stress.
tables
    All as Markdown; ``python -m benchmarks.pushing`` prints it.
"""
