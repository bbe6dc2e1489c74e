"""Errors that end a command, each with its exit code and one sentence for the person who typed it."""


class FlexdoceError(Exception):
    """Base of all errors that are not our bug."""

    exit_code = 1


class InputError(FlexdoceError):
    """A bad config, argument or input file. Nothing was touched."""

    exit_code = 2


class TooManyFailures(FlexdoceError):
    """More runs failed than the study allows. What succeeded is stored."""

    exit_code = 3


class RequirementNotMet(FlexdoceError):
    """The study ran, but a declared requirement does not hold. Everything is written."""

    exit_code = 4
