"""Benchmarks, each side by side with a peer in one run; ``python -m benchmarks`` prints the tables of the docs."""
