"""Errors that end a command, each with its exit code and one sentence for the person who typed it."""

LONGEST = 4000
"""Characters of a sentence; what a hostile file quotes of itself may have millions."""


def one_line(text: str) -> str:
    """The text for a terminal or a log: one line, and a space for what could move the cursor or turn the reading order.

    That is every character that Python calls not printable: control characters, escapes, marks of direction,
    surrogates. Of a very long text the middle is left out.
    """
    line = text if text.isprintable() else " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return line if len(line) <= LONGEST else f"{line[: LONGEST // 2]} … {line[-LONGEST // 4 :]}"


class FlexdoceError(Exception):
    """Base of all errors that are not our bug: one line that any terminal can print."""

    exit_code = 1

    def __init__(self, sentence: str) -> None:
        super().__init__(one_line(sentence))


class InputError(FlexdoceError):
    """A bad config, argument or input file. Nothing was touched."""

    exit_code = 2


class TooManyFailures(FlexdoceError):
    """More runs failed than the study allows. What succeeded is stored."""

    exit_code = 3


class RequirementNotMet(FlexdoceError):
    """The study ran, but a declared requirement does not hold. Everything is written."""

    exit_code = 4
