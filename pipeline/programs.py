"""``[oracle.command]``: any program as an oracle, as a person writes it. What it means is checked by the oracle."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from experiments.oracles.command.folder import Unreadable, read_inside

from .errors import InputError
from .strict import Number, Table

LONGEST_TEXT = 4 * 2**20
"""Bytes of a file that a config can hold."""


class TextTable(Table):
    """A file of the working folder: a file beside the config, whose text is then taken over, or the text itself."""

    file: str | None = Field(default=None, description="relative path, below the config's folder")
    text: str | None = Field(default=None, description="its text; as read from the file, if there is one")


class CommandFactor(Table):
    """A factor of the program."""

    unit: str = Field(description="unit of low and high; '1' if it has none")
    low: Number = Field(description="low end of the range")
    high: Number = Field(description="high end of the range")
    source: str = Field(default="the config", description="where the range comes from")


class CommandResponse(Table):
    """A response of the program, and where its number is found."""

    unit: str = Field(description="unit in which it is stored, SI")
    shown_unit: str = Field(default="", description="unit for people")
    shown_scale: Number = Field(default=1.0, description="shown = stored times this")
    symbol: str = Field(default="", description="how reports write it")
    file: str = Field(default="stdout.txt", description="file in the working folder; what was printed if not given")
    regex: str = Field(default="", description="pattern with one group, around the number")
    column: str = Field(default="", description="header of a CSV column")
    json_path: str = Field(default="", description="keys and positions with dots: steps.-1.tip.uz")
    function: str = Field(default="", description="parser function that an installed package offers")
    take: Literal["first", "last"] = Field(default="last", description="which match, or which row")
    where: dict[str, Number | str] = Field(default={}, description="values that other columns of the row must have")
    delimiter: str = Field(default=",", description="between CSV cells; a space stands for any white space")
    file_unit: str = Field(default="", description="unit of the number in the file; unit, if not given")
    scale: Number = Field(default=1.0, description="the number is multiplied by it")


class ProgramTable(Table):
    """A program: what is run, with which files, and what is read."""

    argv: list[str] = Field(description="program and arguments; {{factor}}, {{folder}} and {{python}} stand for values")
    templates: dict[str, TextTable] = Field(
        default={}, description="files with placeholders such as {{width [mm]:.6e}}"
    )
    files: dict[str, TextTable] = Field(default={}, description="files that are written as they are")
    factors: dict[str, CommandFactor] = Field(description="what is varied")
    responses: dict[str, CommandResponse] = Field(description="what is read")
    time_limit: Number = Field(
        default=3600.0, description="seconds; a run that takes longer is ended, with its children"
    )
    grace: Number = Field(default=2.0, description="seconds between asking a process to end and ending it")
    retries: int = Field(default=0, description="further tries of a run that crashed or timed out")
    exit_codes: list[int] = Field(default=[0], description="exit codes that mean success")
    environment: dict[str, str] = Field(default={}, description="environment variables that are added")
    inherit: list[str] = Field(
        default=[], description="environment variables that are passed on, such as a licence server"
    )
    rejected_if: str = Field(default="", description="pattern in what it prints: the point makes no sense")
    not_converged_if: str = Field(default="", description="pattern in what it prints: it found no solution")
    keep: Literal["failed", "all", "none"] = Field(default="failed", description="working folders that stay")
    version: str = Field(default="", description="version of the program; change it when its answers change")
    resolution: Number = Field(
        default=0.0, description="relative: differences below it are rounding; 1e-6 for 7 digits"
    )
    source: str = Field(default="", description="where the physics comes from")

    @property
    def settings(self) -> dict:
        """As the oracle takes them."""
        return self.model_dump(exclude_none=True)


def embedded(table: ProgramTable, folder: Path, origin: str) -> ProgramTable:
    """The table with the text of every file that it names below `folder`; a text that is there already stays.

    Raises
    ------
    InputError
        If a file is missing, elsewhere, too large, or no UTF-8 text.
    """
    read = {
        which: {
            name: _read(f"{origin}: oracle.command.{which}.{name}", entry, folder) for name, entry in entries.items()
        }
        for which, entries in (("templates", table.templates), ("files", table.files))
    }
    return table.model_copy(update=read)


def _read(what: str, entry: TextTable, folder: Path) -> TextTable:
    if entry.text is not None:
        return entry
    if entry.file is None:
        raise InputError(f"{what} needs a file or a text")
    try:
        return entry.model_copy(update={"text": read_inside(folder, entry.file, LONGEST_TEXT).decode("utf-8")})
    except UnicodeDecodeError:
        raise InputError(
            f"{what}: {entry.file} is not UTF-8 text; name such a file by its absolute path in argv"
        ) from None
    except (Unreadable, ValueError) as error:
        raise InputError(f"{what}: {error}") from None
