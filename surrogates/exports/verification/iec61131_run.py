"""Runs the structured text of an export: types checked as the language has them, numbers in float64.

This is no controller's compiler: it is ours, made because there is none that could be run here. It knows nothing of
the templates that the text comes from, reads it by :mod:`.structured_text_parse`, and is stricter than a controller:
types are never converted, subscripts are checked, and a temporary that is read before it is written is an error.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .iec61131_parse import ELEMENTARY, RELATIONS, Block, NotStructuredText, Shape, Variable, parse

State = dict[str, Any]
Value = tuple[Shape, Callable[[State], Any]]
Step = Callable[[State], str | None]

LREAL, INT, DINT, BOOL = (Shape(base) for base in ELEMENTARY)
LARGEST = {INT: 2**15 - 1, DINT: 2**31 - 1}
INPUTS = ("VAR_INPUT", "CONSTANT")


class NotRunnable(NotStructuredText):
    """The text is of the language, but types disagree, a name is unknown, or something is read before it is written."""


class Program:
    """Blocks of a text, ready to be called.

    Raises
    ------
    NotStructuredText
        If the text is not of the language, or types or names in it disagree.
    """

    def __init__(self, text: str) -> None:
        self.blocks = parse(text)
        self.steps = {name: _Compiler(self.blocks, block, self).body() for name, block in self.blocks.items()}

    def instance(self, name: str) -> "Instance":
        """A new instance of the function block of that name, in any case."""
        return Instance(self, self.blocks[name.upper()])


class Instance:
    """A function block with its variables; called with inputs by name, which then reads its outputs."""

    def __init__(self, program: Program, block: Block) -> None:
        self.program, self.block = program, block
        self.state: State = {v.name: self._initial(v) for v in block.variables.values()}
        self.temporaries = [v for v in block.variables.values() if v.section == "VAR_TEMP"]

    def __call__(self, **inputs: Any) -> dict[str, Any]:
        """Outputs by name in lower case; arrays in and out are of NumPy."""
        shapes = {name: self.block.variables[name.upper()].shape for name in inputs}
        self.run({name.upper(): _inside(value, shapes[name]) for name, value in inputs.items()})
        outputs = (v for v in self.block.variables.values() if v.section == "VAR_OUTPUT")
        return {v.name.lower(): _outside(self.state[v.name], v.shape) for v in outputs}

    def run(self, inputs: dict[str, Any]) -> None:
        """One call; inputs by name in capitals."""
        self.state.update(inputs)
        for v in self.temporaries:
            self.state[v.name] = [None] * _size(v.shape) if v.shape.bounds else None
        _all(self.program.steps[self.block.name], self.state)

    def _initial(self, v: Variable) -> Any:
        if v.shape.base in self.program.blocks:
            return self.program.instance(v.shape.base)
        if v.initial:
            return list(v.initial)
        zero = {"LREAL": 0.0, "INT": 0, "DINT": 0, "BOOL": False}[v.shape.base]
        return [zero] * _size(v.shape) if v.shape.bounds else zero


class _Compiler:
    """Makes one block's statements callable, and checks their types."""

    def __init__(self, blocks: dict[str, Block], block: Block, program: Program) -> None:
        self.blocks, self.block, self.program = blocks, block, program
        for v in block.variables.values():
            if v.shape.base not in ELEMENTARY and v.shape.base not in blocks:
                raise NotRunnable(f"{block.name}: {v.name} is of the unknown type {v.shape.base}")
            if v.section == "CONSTANT" and len(v.initial) != _size(v.shape):
                raise NotRunnable(f"{block.name}: {v.name} has {len(v.initial)} values for {_size(v.shape)} elements")

    def body(self) -> list[Step]:
        return self.steps(self.block.body)

    def steps(self, statements: list[tuple]) -> list[Step]:
        return [getattr(self, f"do_{statement[0]}")(*statement[1:]) for statement in statements]

    def fail(self, why: str) -> NotRunnable:
        return NotRunnable(f"{self.block.name}: {why}")

    def of_type(self, value: tuple, *wanted: Shape) -> Callable[[State], Any]:
        shape, get = self.value(value)
        if shape not in wanted:
            raise self.fail(f"{wanted[0].base} expected, not {_words(shape)}: {value}")
        return get

    def whole(self, tree: tuple, shape: Shape) -> Callable[[State], int]:
        """A whole number of that type; a literal takes the type that is wanted, if it fits."""
        if tree[0] != "int":
            return self.of_type(tree, shape)
        if tree[1] > LARGEST[shape]:
            raise self.fail(f"{tree[1]} is beyond {shape.base}")
        return lambda _: tree[1]

    # --- statements ---------------------------------------------------------------------------------------------------

    def do_exit(self) -> Step:
        return lambda _: "exit"

    def do_return(self) -> Step:
        return lambda _: "return"

    def do_if(self, branches: list[tuple], otherwise: list[tuple]) -> Step:
        made = [(self.of_type(condition, BOOL), self.steps(body)) for condition, body in branches]
        last = self.steps(otherwise)

        def step(s: State) -> str | None:
            for condition, body in made:
                if condition(s):
                    return _all(body, s)
            return _all(last, s)

        return step

    def do_for(self, counter: str, first: tuple, last: tuple, by: int, body: list[tuple]) -> Step:
        shape = self.variable(counter).shape
        if shape not in LARGEST or by == 0:
            raise self.fail(f"{counter} must be of type INT or DINT and its step not 0")
        begin, end, made = self.whole(first, shape), self.whole(last, shape), self.steps(body)

        def step(s: State) -> str | None:
            for k in range(begin(s), end(s) + (1 if by > 0 else -1), by):
                s[counter] = k
                if left := _all(made, s):
                    return None if left == "exit" else left
            s[counter] = None  # the standard does not say what it is now
            return None

        return step

    def do_assign(self, target: tuple, value: tuple) -> Step:
        _, name, part, subscripts = target
        if part:
            raise self.fail(f"{name}.{part} belongs to another block and is assigned")
        is_result = name == self.block.name and self.block.returns
        v = Variable(name, "VAR_OUTPUT", LREAL) if is_result else self.variable(name)
        if v.section in INPUTS:
            raise self.fail(f"{name} is an input or a constant and is assigned")
        if not subscripts:
            get = self.of_type(value, v.shape)
            copy = bool(v.shape.bounds)

            def whole(s: State) -> None:
                s[name] = list(get(s)) if copy else get(s)

            return whole
        get, at = self.of_type(value, Shape(v.shape.base)), self.offset(v.shape, subscripts)

        def element(s: State) -> None:
            s[name][at(s)] = get(s)

        return element

    def do_call(self, target: tuple, given: list[tuple]) -> Step:
        called = self.blocks.get(self.variable(target[1]).shape.base)
        if called is None or called.returns:
            raise self.fail(f"{target[1]} is no function block and is called")
        inputs = {v.name: v.shape for v in called.variables.values() if v.section == "VAR_INPUT"}
        if [formal for formal, _ in given] != list(inputs):
            raise self.fail(f"{target[1]} takes {', '.join(inputs)}")
        made = [(formal, self.of_type(value, inputs[formal])) for formal, value in given]

        def step(s: State) -> None:
            values = {formal: get(s) for formal, get in made}
            s[target[1]].run({k: list(v) if isinstance(v, list) else v for k, v in values.items()})

        return step

    # --- expressions --------------------------------------------------------------------------------------------------

    def variable(self, name: str) -> Variable:
        if name not in self.block.variables:
            raise self.fail(f"{name} is not declared")
        return self.block.variables[name]

    def offset(self, shape: Shape, subscripts: tuple) -> Callable[[State], int]:
        if len(subscripts) != len(shape.bounds):
            raise self.fail(f"{len(subscripts)} subscripts for {_words(shape)}")
        places = [
            (self.of_type(sub, INT), low, high) for sub, (low, high) in zip(subscripts, shape.bounds, strict=True)
        ]

        def at(s: State) -> int:
            found = 0
            for get, low, high in places:
                k = get(s)
                if not low <= k <= high:
                    raise NotRunnable(f"{self.block.name}: subscript {k} is outside {low}..{high}")
                found = found * (high - low + 1) + k - low
            return found

        return at

    def value(self, tree: tuple) -> Value:
        kind = tree[0]
        if kind in ("real", "int", "bool"):
            constant = tree[1]
            if kind == "int":
                return INT, self.whole(tree, INT)
            return (LREAL if kind == "real" else BOOL), lambda _: constant
        if kind == "name":
            return self.named(*tree[1:])
        if kind == "function":
            return self.function(*tree[1:])
        if kind == "not":
            truth = self.of_type(tree[1], BOOL)
            return BOOL, lambda s: not truth(s)
        if kind == "minus":
            shape, get = self.value(tree[1])
            if shape not in (LREAL, INT):
                raise self.fail(f"minus {_words(shape)}")
            return shape, lambda s: -get(s)
        return self.operation(*tree)

    def named(self, name: str, part: str, subscripts: tuple) -> Value:
        v = self.variable(name)
        if part:
            called = self.blocks.get(v.shape.base)
            inner = called.variables.get(part) if called else None
            if inner is None or inner.section != "VAR_OUTPUT":
                raise self.fail(f"{name} has no output {part}")
            shape, whole = inner.shape, lambda s: s[name].state[part]
        else:
            shape, whole = v.shape, lambda s: s[name]
        at = self.offset(shape, subscripts) if subscripts else None

        def get(s: State) -> Any:
            found = whole(s) if at is None else whole(s)[at(s)]
            if found is None:
                raise NotRunnable(f"{self.block.name}: {name} is read before it is written")
            return found

        return (shape if at is None else Shape(shape.base)), get

    def function(self, name: str, given: tuple) -> Value:
        if name in MATHEMATICS:
            if len(given) != 1:
                raise self.fail(f"{name} takes one number")
            apply, argument = MATHEMATICS[name], self.of_type(given[0], LREAL)
            return LREAL, lambda s: apply(argument(s))
        called = self.blocks.get(name)
        if called is None or not called.returns:
            raise self.fail(f"{name} is no function that is declared, or that this runs")
        formals = [v for v in called.variables.values() if v.section == "VAR_INPUT"]
        if len(formals) != len(given):
            raise self.fail(f"{name} takes {len(formals)} numbers")
        made = [(v.name, self.of_type(tree, v.shape)) for v, tree in zip(formals, given, strict=True)]

        def call(s: State) -> Any:
            inner = {formal: get(s) for formal, get in made}
            _all(self.program.steps[name], inner)
            return inner[name]

        return LREAL, call

    def operation(self, mark: str, left: tuple, right: tuple) -> Value:
        shape, a = self.value(left)
        allowed = (BOOL,) if mark in ("AND", "OR") else (LREAL, INT, BOOL) if mark in RELATIONS[:2] else (LREAL, INT)
        if shape not in allowed or (mark == "/" and shape != LREAL):
            raise self.fail(f"{mark} of {_words(shape)}")
        b = self.of_type(right, shape)
        apply = OPERATIONS[mark]
        result = BOOL if mark in ("AND", "OR", *RELATIONS) else shape
        return result, lambda s: apply(a(s), b(s))


def _divide(a: float, b: float) -> float:
    if b:
        return a / b
    return math.nan if a == 0.0 or math.isnan(a) else math.copysign(math.inf, a) * math.copysign(1.0, b)


def _exponential(x: float) -> float:
    try:
        return math.exp(x)
    except OverflowError:
        return math.inf


def _logarithm(x: float) -> float:
    return math.log(x) if x > 0.0 else -math.inf if x == 0.0 else math.nan


OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": _divide,
    "=": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
}
MATHEMATICS: dict[str, Callable[[float], float]] = {"ABS": abs, "EXP": _exponential, "LN": _logarithm}


def _all(steps: list[Step], s: State) -> str | None:
    for step in steps:
        if left := step(s):
            return left
    return None


def _size(shape: Shape) -> int:
    return math.prod(high - low + 1 for low, high in shape.bounds)


def _words(shape: Shape) -> str:
    return f"an array of {shape.base}" if shape.bounds else shape.base


def _inside(value: Any, shape: Shape) -> Any:
    flat = np.asarray(value, dtype=np.float64).ravel().tolist()
    if len(flat) != _size(shape):
        raise ValueError(f"{len(flat)} numbers are given for {_words(shape)} of {_size(shape)}")
    return flat if shape.bounds else flat[0]


def _outside(value: Any, shape: Shape) -> NDArray[np.float64] | Any:
    return np.reshape(value, [high - low + 1 for low, high in shape.bounds]) if shape.bounds else value
