"""``python -m pipeline.schema > configs/schema.json``: the config's JSON schema, for editors and a test."""

import json

from .config import json_schema


def schema_json() -> str:
    """The schema as the text of ``configs/schema.json``."""
    return json.dumps(json_schema(), indent=2) + "\n"


if __name__ == "__main__":
    print(schema_json(), end="")
