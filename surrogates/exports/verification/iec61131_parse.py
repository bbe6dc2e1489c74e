"""A reader of the part of IEC 61131-3 structured text that the export is written in, stricter than the language.

Source: IEC 61131-3:2013 (3rd ed.): identifiers 6.1.2, comments 6.1.5, literals 6.3, declarations 6.5 and 6.6,
expressions with their precedence 7.3.2, statements 7.3.3. Names are the same in upper and lower case. What the
second edition or a vendor's compiler might take otherwise (nested comments, ``//``) is an error here.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

_TOKEN = re.compile(
    r"\s+|(?P<comment>\(\*(?:(?!\*\)).)*\*\))|(?P<real>\d+\.\d+(?:[Ee][+-]?\d+)?)|(?P<int>\d+(?![\w.]))|(?P<bound>\d+(?=\.\.))"
    r"|(?P<name>[A-Za-z][A-Za-z0-9_]*)|(?P<mark>:=|<>|<=|>=|\.\.|[-+*/=<>()\[\],;:.])",
    re.DOTALL,
)

_KEYWORDS = """
    ACTION AND ARRAY AT BOOL BY BYTE CASE CONFIGURATION CONSTANT CONTINUE DATE DINT DO DT DWORD ELSE ELSIF END_ACTION
    END_CASE END_CONFIGURATION END_FOR END_FUNCTION END_FUNCTION_BLOCK END_IF END_PROGRAM END_REPEAT END_RESOURCE
    END_STEP END_STRUCT END_TRANSITION END_TYPE END_VAR END_WHILE EN ENO EXIT EXTENDS FALSE FINAL FOR FROM FUNCTION
    FUNCTION_BLOCK IF IMPLEMENTS INITIAL_STEP INT INTERFACE INTERVAL LINT LREAL LWORD METHOD MOD NON_RETAIN NOT NULL OF
    ON OR OVERLAP OVERRIDE PRIORITY PRIVATE PROGRAM PROTECTED PUBLIC READ_ONLY READ_WRITE REAL REF REPEAT RESOURCE
    RETAIN RETURN SINGLE SINT STEP STRING STRUCT SUPER TASK THEN THIS TIME TO TOD TRANSITION TRUE TYPE UDINT UINT ULINT
    UNTIL USING USINT VAR VAR_ACCESS VAR_CONFIG VAR_EXTERNAL VAR_GLOBAL VAR_INPUT VAR_IN_OUT VAR_OUTPUT VAR_TEMP WHILE
    WITH WORD WSTRING XOR
"""
KEYWORDS = frozenset(_KEYWORDS.split())
"""Table 4 and annex A of the standard, as far as they are words."""

_FUNCTIONS = """
    ABS ACOS ADD ASIN ATAN ATAN2 CONCAT COS CTD CTU CTUD DELETE DIV EQ EXP EXPT F_TRIG FIND GE GT INSERT LE LEFT LEN
    LIMIT LN LOG LT MAX MID MIN MOVE MUL MUX NE REPLACE RIGHT ROL ROR RS R_TRIG SEL SHL SHR SIN SQRT SR SUB TAN TOF TON
    TP TRUNC
"""
FUNCTIONS = frozenset(_FUNCTIONS.split())
"""Standard functions and function blocks, sections 6.6.2.5 and 6.6.3.5."""

SECTIONS = ("VAR_INPUT", "VAR_OUTPUT", "VAR_TEMP", "VAR")
ELEMENTARY = ("LREAL", "INT", "DINT", "BOOL")
RELATIONS = ("=", "<>", "<", ">", "<=", ">=")


class NotStructuredText(ValueError):
    """The text is not what the export may write."""


class Token(NamedTuple):
    """A word of the text: its kind, itself in capitals, where it begins."""

    kind: str
    text: str
    at: int


class Shape(NamedTuple):
    """A type: of an elementary type or block, and the array's bounds if it is one."""

    base: str
    bounds: tuple[tuple[int, int], ...] = ()


class Variable(NamedTuple):
    """A declaration: section in capitals (``"CONSTANT"`` for constants), initial values of a constant."""

    name: str
    section: str
    shape: Shape
    initial: tuple[float, ...] = ()


@dataclass
class Block:
    """A function block, or a function if it returns something."""

    name: str
    returns: str = ""
    variables: dict[str, Variable] = field(default_factory=dict)
    body: list[tuple] = field(default_factory=list)


def tokens(text: str) -> list[Token]:
    """Words of the text, comments left out.

    Raises
    ------
    NotStructuredText
        If something is no word of the language, or a comment holds the beginning of another.
    """
    found, at = [], 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        if not match:
            raise NotStructuredText(f"line {text.count(chr(10), 0, at) + 1}: cannot read {text[at : at + 20]!r}")
        kind = match.lastgroup
        if kind == "comment" and "(*" in match[0][2:]:
            raise NotStructuredText(f"line {text.count(chr(10), 0, at) + 1}: a comment in a comment")
        if kind and kind != "comment":
            found.append(Token("int" if kind == "bound" else kind, match[0].upper(), at))
        at = match.end()
    return found


def parse(text: str) -> dict[str, Block]:
    """Function blocks and functions by name in capitals.

    Raises
    ------
    NotStructuredText
        If the text is not of the language, or not of the part that the export uses.
    """
    reader, blocks = _Reader(text), {}
    while reader.peek():
        block = reader.block()
        if block.name in blocks:
            raise NotStructuredText(f"{block.name} is declared twice")
        blocks[block.name] = block
    return blocks


class _Reader:
    """Recursive descent, one method a rule."""

    def __init__(self, text: str) -> None:
        self.text, self.tokens, self.at = text, tokens(text), 0

    def peek(self) -> str:
        return self.tokens[self.at].text if self.at < len(self.tokens) else ""

    def take(self, *expected: str) -> str:
        found = self.peek()
        if not found or (expected and found not in expected):
            position = self.tokens[self.at].at if found else len(self.text)
            line = self.text.count("\n", 0, position) + 1
            raise NotStructuredText(f"line {line}: {' or '.join(expected)} expected, not {found or 'the end'!r}")
        self.at += 1
        return found

    def maybe(self, expected: str) -> bool:
        if self.peek() != expected:
            return False
        self.at += 1
        return True

    def name(self) -> str:
        kind, found = (self.tokens[self.at].kind if self.peek() else ""), self.take()
        if kind != "name" or found in KEYWORDS or found in FUNCTIONS:
            raise NotStructuredText(f"{found!r} cannot be the name of anything")
        if "__" in found or found.endswith("_"):
            raise NotStructuredText(f"{found!r} is no identifier: two underscores in a row, or one at the end")
        return found

    def integer(self) -> int:
        sign = -1 if self.maybe("-") else 1
        found = self.take()
        if not found.isdigit():
            raise NotStructuredText(f"a whole number expected, not {found!r}")
        return sign * int(found)

    def block(self) -> Block:
        kind = self.take("FUNCTION_BLOCK", "FUNCTION")
        block = Block(self.name())
        if kind == "FUNCTION":
            self.take(":")
            block.returns = self.take("LREAL")
        while self.peek() in SECTIONS:
            self.declarations(block)
        block.body = self.statements(f"END_{kind}")
        self.take(f"END_{kind}")
        return block

    def declarations(self, block: Block) -> None:
        section = self.take(*SECTIONS)
        if section == "VAR" and self.maybe("CONSTANT"):
            section = "CONSTANT"
        while not self.maybe("END_VAR"):
            names = [self.name()]
            while self.maybe(","):
                names.append(self.name())
            self.take(":")
            shape, initial = self.shape(), ()
            if section == "CONSTANT":
                self.take(":=")
                initial = self.initial()
            self.take(";")
            for name in names:
                if name in block.variables or name == block.name:
                    raise NotStructuredText(f"{name} is declared twice in {block.name}")
                block.variables[name] = Variable(name, section, shape, initial)

    def shape(self) -> Shape:
        if not self.maybe("ARRAY"):
            return Shape(self.take() if self.peek() in ELEMENTARY else self.name())
        bounds = []
        self.take("[")
        while True:
            low = self.integer()
            self.take("..")
            bounds.append((low, self.integer()))
            if self.take(",", "]") == "]":
                break
        self.take("OF")
        return Shape(self.take("LREAL", "BOOL"), tuple(bounds))

    def initial(self) -> tuple[float, ...]:
        values = []
        self.take("[")
        while True:
            sign = -1.0 if self.maybe("-") else 1.0
            if self.tokens[self.at].kind != "real":
                raise NotStructuredText(f"a real literal expected, not {self.peek()!r}")
            values.append(sign * float(self.take()))
            if self.take(",", "]") == "]":
                return tuple(values)

    def statements(self, *ends: str) -> list[tuple]:
        found = []
        while self.peek() not in ends:
            found.append(self.statement())
        return found

    def statement(self) -> tuple:
        if self.maybe("IF"):
            return self.choice()
        if self.maybe("FOR"):
            return self.loop()
        alone = self.peek() in ("EXIT", "RETURN")
        found = (self.take().lower(),) if alone else self.assignment_or_call()
        self.take(";")
        return found

    def choice(self) -> tuple:
        branches, otherwise = [], []
        while True:
            condition = self.expression()
            self.take("THEN")
            branches.append((condition, self.statements("ELSIF", "ELSE", "END_IF")))
            end = self.take("ELSIF", "ELSE", "END_IF")
            if end == "ELSE":
                otherwise = self.statements("END_IF")
                self.take("END_IF")
            if end != "ELSIF":
                self.take(";")
                return "if", branches, otherwise

    def loop(self) -> tuple:
        counter = self.name()
        self.take(":=")
        first = self.expression()
        self.take("TO")
        last = self.expression()
        by = self.integer() if self.maybe("BY") else 1
        self.take("DO")
        body = self.statements("END_FOR")
        self.take("END_FOR")
        self.take(";")
        return "for", counter, first, last, by, body

    def assignment_or_call(self) -> tuple:
        target = self.reference(self.name())
        if not self.maybe("("):
            self.take(":=")
            return "assign", target, self.expression()
        given = []
        while True:
            formal = self.name()
            self.take(":=")
            given.append((formal, self.expression()))
            if self.take(",", ")") == ")":
                return "call", target, given

    def reference(self, name: str) -> tuple:
        """``name``, ``name.field``, each with subscripts if there are any."""
        part = self.name() if self.maybe(".") else ""
        subscripts = []
        if self.maybe("["):
            subscripts.append(self.expression())
            while self.take(",", "]") == ",":
                subscripts.append(self.expression())
        return "name", name, part, tuple(subscripts)

    def expression(self) -> tuple:
        return self._left(("OR",), lambda: self._left(("AND",), self._equality))

    def _equality(self) -> tuple:
        return self._left(RELATIONS[:2], lambda: self._left(RELATIONS[2:], self._sum))

    def _sum(self) -> tuple:
        return self._left(("+", "-"), lambda: self._left(("*", "/"), self._unary))

    def _left(self, marks: tuple[str, ...], inner: Callable[[], tuple]) -> tuple:
        found = inner()
        while self.peek() in marks:
            mark = self.take()
            found = (mark, found, inner())
        return found

    def _unary(self) -> tuple:
        if self.peek() in ("-", "NOT"):
            return {"-": "minus", "NOT": "not"}[self.take()], self._unary()
        return self._primary()

    def _primary(self) -> tuple:
        if self.maybe("("):
            found = self.expression()
            self.take(")")
            return found
        kind = self.tokens[self.at].kind if self.peek() else ""
        if kind in ("real", "int"):
            text = self.take()
            return (kind, float(text) if kind == "real" else int(text))
        if self.peek() in ("TRUE", "FALSE"):
            return "bool", self.take() == "TRUE"
        name = self.take() if self.peek() in FUNCTIONS else self.name()
        if name not in FUNCTIONS and self.peek() != "(":
            return self.reference(name)
        self.take("(")
        given = [self.expression()]
        while self.take(",", ")") == ",":
            given.append(self.expression())
        return "function", name, tuple(given)
