"""Mutants: a source file with one small mistake in it, for every small mistake that can be made.

An operator, a comparison, a constant, a condition, `min` for `max`, a sine for a cosine. Strings and annotations stay.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass

COMPARISONS: dict[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
}
NAMES = {"min": "max", "max": "min", "sin": "cos", "cos": "sin", "any": "all", "all": "any"}


@dataclass(frozen=True, slots=True)
class Mutant:
    """One mistake.

    Attributes:
        line: Where.
        before: The expression or statement as it is, in one line.
        after: As it is in the mutant.
        source: The whole file with it.
    """

    line: int
    before: str
    after: str
    source: str


def mutants_of(source: str) -> Iterator[Mutant]:
    """Make all mutants of a file, from its first line to its last."""
    tree = ast.parse(source)
    for number, place in enumerate(_places(tree)):
        for changed in _changes(place):
            other = ast.parse(source)
            twin = _places(other)[number]
            for field, value in ast.iter_fields(changed):
                setattr(twin, field, value)
            ast.fix_missing_locations(other)
            yield Mutant(
                _position(place)[0],
                _line_of(place),
                _line_of(changed),
                ast.unparse(other),
            )


def _places(tree: ast.Module) -> list[ast.AST]:
    """What can be changed, in the order of the source; not annotations, decorators and messages of errors."""
    hidden: set[int] = set()
    for node in ast.walk(tree):
        parts: list[ast.AST | None] = []
        if isinstance(node, ast.FunctionDef):
            parts = [node.returns, *node.decorator_list, *(a.annotation for a in node.args.args)]
        elif isinstance(node, ast.AnnAssign):
            parts = [node.annotation]
        elif isinstance(node, ast.Raise):
            parts = [node.exc]
        for part in parts:
            if part is not None:
                hidden.update(id(inner) for inner in ast.walk(part))
    changeable = ast.Compare | ast.BinOp | ast.UnaryOp | ast.BoolOp | ast.Constant | ast.Call
    statements = ast.If | ast.IfExp | ast.AugAssign
    found = [
        node
        for node in ast.walk(tree)
        if isinstance(node, changeable | statements) and id(node) not in hidden
    ]
    return sorted(found, key=lambda node: (_position(node), ast.unparse(node)))


def _position(node: ast.AST) -> tuple[int, int]:
    # Expressions and statements have one.
    return getattr(node, "lineno", 0), getattr(node, "col_offset", 0)


def _changes(node: ast.AST) -> Iterator[ast.AST]:
    """Wrong versions of a node of the same kind, so that its fields can take its place."""
    changed = copy.deepcopy(node)
    if isinstance(changed, ast.Compare) and type(changed.ops[0]) in COMPARISONS:
        changed.ops[0] = COMPARISONS[type(changed.ops[0])]()
    elif isinstance(changed, ast.BinOp | ast.AugAssign) and type(changed.op) in OPERATORS:
        changed.op = OPERATORS[type(changed.op)]()
    elif isinstance(changed, ast.UnaryOp):
        # A sign goes, and a `not`: twice is none.
        changed.operand = ast.UnaryOp(changed.op, changed.operand)
    elif isinstance(changed, ast.BoolOp):
        changed.op = ast.Or() if isinstance(changed.op, ast.And) else ast.And()
    elif isinstance(changed, ast.Constant) and isinstance(changed.value, bool):
        changed.value = not changed.value
    elif isinstance(changed, ast.Constant) and isinstance(changed.value, int | float):
        changed.value = changed.value + 1
    elif isinstance(changed, ast.If | ast.IfExp):
        changed.test = ast.UnaryOp(ast.Not(), changed.test)
    elif not (isinstance(changed, ast.Call) and _swap_name(changed)):
        return
    yield changed


def _swap_name(call: ast.Call) -> bool:
    """Call the opposite function; returns whether there is one."""
    function = call.func
    if isinstance(function, ast.Name) and function.id in NAMES:
        function.id = NAMES[function.id]
    elif isinstance(function, ast.Attribute) and function.attr in NAMES:
        function.attr = NAMES[function.attr]
    else:
        return False
    return True


def _line_of(node: ast.AST) -> str:
    """The code of a node in one line; of a branch its condition."""
    text = ast.unparse(node.test) if isinstance(node, ast.If) else ast.unparse(node)
    return " ".join(text.split())
