"""Errors that end a command, each with its exit code and one sentence for the person who typed it."""

import re

_CONTROL = re.compile(r"[\x00-\x1f\x7f\ud800-\udfff]+")


class FlexdoceError(Exception):
    """Base of all errors that are not our bug: one line that any terminal can print."""

    exit_code = 1

    def __init__(self, sentence: str) -> None:
        super().__init__(_CONTROL.sub(" ", sentence))


class InputError(FlexdoceError):
    """A bad config, argument or input file. Nothing was touched."""

    exit_code = 2


class TooManyFailures(FlexdoceError):
    """More runs failed than the study allows. What succeeded is stored."""

    exit_code = 3


class RequirementNotMet(FlexdoceError):
    """The study ran, but a declared requirement does not hold. Everything is written."""

    exit_code = 4
