"""What a TOML text must not be: so long or so deep that reading it takes minutes or gigabytes."""

import re

DEEPEST, LONGEST, LONGEST_BARE = 20, 32 * 2**20, 2**20
"""Parts of a dotted key (of ours the deepest has five); characters of a document, and of what is no text in it.

Python's reader takes ten seconds and half a gigabyte for a key of 10,000 parts, and a second for a million characters
of numbers. Texts, such as the templates of a program, cost next to nothing.
"""

_BEGIN = re.compile(r'"""|\'\'\'|"|\'|#')
_REST = {
    '"""': re.compile(r'(?:[^"\\]++|\\.|"(?!""))*+"{3,5}', re.DOTALL),
    "'''": re.compile(r"(?:[^']++|'(?!''))*+'{3,5}"),
    '"': re.compile(r'(?:[^"\\\n]++|\\.)*+"'),
    "'": re.compile(r"[^'\n]*+'"),
    "#": re.compile(r"[^\n]*+"),
}
_KEYS = re.compile(r"[A-Za-z0-9_.\- \t]+")


def excess(document: str) -> str:
    """Why a TOML document is too much to read, found in time linear in its length; empty if it is not."""
    if len(document) > LONGEST:
        return f"it has {len(document)} characters, at most {LONGEST} are read"
    bare = _without_texts(document)
    if len(bare) > LONGEST_BARE:
        return f"it has {len(bare)} characters beside its texts, at most {LONGEST_BARE} are read"
    # Outside of texts and comments, a run of these characters has no more dots than one key or one number.
    if any(run.group().count(".") >= DEEPEST for run in _KEYS.finditer(bare)):
        return f"it is nested too deep: a dotted key has more than {DEEPEST} parts"
    return ""


def _without_texts(document: str) -> str:
    """The document with a letter for every text, and without comments; up to the first text that does not end."""
    pieces, at = [], 0
    while begin := _BEGIN.search(document, at):
        pieces.append(document[at : begin.start()])
        rest = _REST[begin.group()].match(document, begin.end())
        if rest is None:
            return "".join(pieces)
        pieces.append("" if begin.group() == "#" else "x")
        at = rest.end()
    return "".join([*pieces, document[at:]])
