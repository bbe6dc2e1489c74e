"""``log.txt``: what happened in a run folder and when, to be read the next morning."""

import logging
from contextlib import suppress
from pathlib import Path

from .errors import one_line

LOG = "log.txt"
LAYOUT = logging.Formatter("%(asctime)s  %(message)s", "%Y-%m-%d %H:%M:%S")


class Log:
    """Lines with the local time, added to what is there. A log that cannot be written stops no study.

    Parameters
    ----------
    folder : Path
    """

    def __init__(self, folder: Path) -> None:
        self._handler: logging.Handler | None = None
        try:
            self._handler = _Quiet(folder / LOG, encoding="utf-8", errors="replace")
        except OSError:
            return
        self._handler.setFormatter(LAYOUT)

    def write(self, sentence: str) -> None:
        """One line; line ends within it, and what could steer a terminal, become spaces."""
        if self._handler is not None:
            text = one_line(" ".join(sentence.split()))
            self._handler.handle(logging.LogRecord("flexdoce", logging.INFO, "", 0, text, None, None))

    def close(self) -> None:
        """Nothing can be written after."""
        if self._handler is not None:
            handler, self._handler = self._handler, None
            # What was still to be written may find no room.
            with suppress(OSError):
                handler.close()


class _Quiet(logging.FileHandler):
    """Says nothing of a full disk: the study itself will."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Nothing."""
