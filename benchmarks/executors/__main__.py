"""``python -m benchmarks.executors``."""

from . import table

if __name__ == "__main__":
    print(table())
