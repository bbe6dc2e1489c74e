"""``[[compare]]`` of a config: models of other studies, to be shown beside this one's."""

from collections.abc import Sequence
from pathlib import Path

from pydantic import Field

from experiments.factors import FactorSpace
from experiments.oracles.command.folder import Unreadable, read_inside
from experiments.runs import Response
from surrogates import Surrogate, loads
from surrogates.comparison import aligned, common_box

from .errors import InputError
from .strict import Table

LONGEST_MODEL = 4 * 2**20
"""Bytes of a model that a config can hold."""


class CompareTable(Table):
    """A model of another study, shown beside this one's: the same factors and responses, another oracle."""

    name: str = Field(
        pattern=r"^[A-Za-z][A-Za-z0-9_]*$", description="what the report calls it: letters, digits, underscores"
    )
    model: str = Field(description="its model.json: relative path, below the config's folder")
    text: str | None = Field(default=None, description="the model itself; as read from the file, if there is one")


def with_models(tables: Sequence[CompareTable], folder: Path, origin: str) -> list[CompareTable]:
    """The tables with the text of every model that they name below `folder`; a text that is there already stays.

    The text goes into the config, as those of templates do, rather than into a file of its own: the run folder then
    says all that was compared, and a folder whose config has another model is known to be of another study.

    Raises
    ------
    InputError
        If a file is missing, elsewhere, too large, or no UTF-8 text.
    """
    return [
        one if one.text is not None else one.model_copy(update={"text": _read(one, folder, origin)}) for one in tables
    ]


def _read(table: CompareTable, folder: Path, origin: str) -> str:
    where = f"{origin}: compare.{table.name}"
    try:
        return read_inside(folder, table.model, LONGEST_MODEL).decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{where}: {table.model} is not UTF-8 text; name the model.json of a study") from None
    except (Unreadable, ValueError) as error:
        raise InputError(f"{where}: {error}") from None


def compared_models(
    tables: Sequence[CompareTable], space: FactorSpace, responses: tuple[Response, ...]
) -> dict[str, Surrogate]:
    """The models by name, each of this study's factors and responses.

    Raises
    ------
    InputError
        If two names are alike, a text is no model or was changed since it was written, or a model is of other factors
        or responses, or of ranges that have nothing in common with `space`.
    """
    found: dict[str, Surrogate] = {}
    for table in tables:
        where = f"compare.{table.name}"
        # Names become file names, and some file systems take capitals for small letters.
        if table.name.lower() in (name.lower() for name in found):
            raise InputError(f"{where}: the name is used twice; names must differ by more than capitals")
        if table.text is None:
            raise InputError(f"{where}: {table.model} was not read; load the config from its file")
        try:
            model = loads(table.text)
            common_box(space, aligned(model, space, responses).factors)
        except ValueError as error:
            raise InputError(f"{where}: {table.model}: {error}") from None
        found[table.name] = model
    return found
