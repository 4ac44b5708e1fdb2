"""Would the tests notice? Mutants of gate and interlock: ``python -m tests.benchmarks.mutation``.

``[MODULE ...] [--within FUNCTION]`` takes some of the modules, or the mutants of one function only.

Each mutant differs from the module in one place: a comparison, an operator, a constant, a
condition, a call or a statement. It is installed in a forked process before the module's tests are
imported there, and those must fail. Texts of messages, and what is computed inside of them, are
left alone: they are not what keeps a joint from moving. A survivor is a hole in the tests, or it
is in `EQUIVALENT` with the reason why nothing could tell it from the original.
"""

from __future__ import annotations

import argparse
import ast
import copy
import importlib
import os
import resource
import sys
import types
from collections.abc import Iterator
from pathlib import Path

import pytest

TARGETS = {
    "agent.cycle.interlock": ("tests/safety/test_interlock.py",),
    "agent.cycle.gate": ("tests/safety/test_gate.py", "tests/safety/test_gate_positions.py"),
}
LIMIT_S = 60
"""A mutant whose tests take so much processor time hangs, and is noticed, too."""

EQUIVALENT: dict[str, str] = {
    "`return ''` becomes `return None`": "equivalent: a reason is only asked whether there is one",
    "`step_rad > 0.0` becomes `step_rad >= 0.0`": "equivalent: nobody asks about a step of nothing",
}
"""Survivors that no test can notice, by the words of the mutation, with the reason."""

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
}
OTHER_MEMBER = {"State": "TRIPPED", "Event": "TRIP", "DriveState": "QUICK_STOP"}
"""What a member of an enumeration is exchanged for."""

OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
}


def mutants(tree: ast.Module) -> Iterator[tuple[str, ast.Module]]:
    """Yield what was changed, in words, and the module with that one change."""
    for index, node in enumerate(_judging(tree)):
        for number in range(len(_changes(node))):
            mutant = copy.deepcopy(tree)
            target = _judging(mutant)[index]
            words, new = _changes(target)[number]
            _Swap(target, new).visit(mutant)
            yield f"line {node.lineno}: {words}", ast.fix_missing_locations(mutant)


class _Swap(ast.NodeTransformer):
    """Puts one node in the place of another."""

    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old = old
        self.new = new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else self.generic_visit(node)


def _judging(tree: ast.Module) -> list[ast.expr | ast.stmt]:
    """Return the nodes that decide something: no annotations, no docstrings, no messages."""
    found: list[ast.expr | ast.stmt] = []

    def walk(node: ast.AST) -> None:
        if isinstance(node, ast.JoinedStr):
            return
        if isinstance(node, ast.expr | ast.stmt):
            found.append(node)
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "bases"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    walk(child)

    walk(tree)
    return found


def _changes(node: ast.expr | ast.stmt) -> list[tuple[str, ast.AST]]:
    """Return every change of one node: in words, and what takes its place."""
    text = ast.unparse(node.test if isinstance(node, ast.If) else node).split("\n")[0]
    new = _other_expressions(node) if isinstance(node, ast.expr) else _other_statements(node)
    return [(f"`{text}` becomes `{ast.unparse(n).split(chr(10))[0]}`", n) for n in new]


def _other_statements(node: ast.stmt) -> list[ast.AST]:
    """Return a condition decided, a reason left out of a result, a call left out."""
    match node:
        case ast.If(body=body, orelse=orelse):
            return [ast.If(ast.Constant(to), body, orelse) for to in (True, False)]
        case ast.Return(value=ast.Tuple(elts=elts)) if elts:
            rest = [elts[:i] + elts[i + 1 :] for i in range(len(elts))]
            return [ast.Return(ast.Tuple(left, ast.Load())) for left in rest]
        case ast.Return(value=ast.expr()):
            return [ast.Return(ast.Constant(None))]
        case ast.Expr(value=ast.Call()):
            return [ast.Pass()]
        case _:
            return []


def _other_expressions(node: ast.expr) -> list[ast.AST]:
    """Return what the expression might have been by a slip of the pen."""
    match node:
        case ast.Compare():
            return _other_comparisons(node)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return [ast.BinOp(left, OPERATORS[type(op)](), right)]
        case ast.BoolOp(op=op, values=values):
            return [ast.BoolOp(ast.Or() if isinstance(op, ast.And) else ast.And(), values)]
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            return [operand]
        case ast.Constant():
            return _other_constants(node.value)
        case ast.Call(func=ast.Name(id="abs" | "max" | "min"), args=args):
            return list(args)
        case ast.Dict(keys=keys, values=values):
            return [_without(keys, values, i) for i in range(len(keys))]
        case ast.Attribute(value=ast.Name(id="State" | "Event" | "DriveState") as table):
            other = OTHER_MEMBER[table.id]
            return [ast.Attribute(table, other, ast.Load())] if node.attr != other else []
        case _:
            return []


def _other_constants(value: object) -> list[ast.AST]:
    """Return other numbers or truths; texts are left alone."""
    if isinstance(value, bool):
        return [ast.Constant(not value)]
    if not isinstance(value, int | float):
        return []
    return [ast.Constant(value + 1), ast.Constant(-value)] if value else [ast.Constant(1.0)]


def _without(keys: list[ast.expr | None], values: list[ast.expr], index: int) -> ast.Dict:
    """Return a table that lacks one row."""
    return ast.Dict(keys[:index] + keys[index + 1 :], values[:index] + values[index + 1 :])


def _other_comparisons(node: ast.Compare) -> list[ast.AST]:
    """Return the comparison with each of its operators exchanged."""
    return [
        ast.Compare(node.left, [*node.ops[:i], other(), *node.ops[i + 1 :]], node.comparators)
        for i, op in enumerate(node.ops)
        for other in COMPARISONS.get(type(op), ())
    ]


def is_noticed(name: str, mutant: ast.Module, tests: tuple[str, ...]) -> bool:
    """Return whether the tests fail, or hang, when the module `name` is the mutant."""
    child = os.fork()
    if child == 0:
        os._exit(_run_in_child(name, mutant, tests))
    _, status = os.waitpid(child, 0)
    return status != 0


def _run_in_child(name: str, mutant: ast.Module, tests: tuple[str, ...]) -> int:
    """Install the mutant, run the tests silently, return pytest's exit code."""
    # not by the clock: beside other programs, at a low priority, sound tests would be called slow
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    module = types.ModuleType(name)
    sys.modules[name] = module
    parent, _, leaf = name.rpartition(".")
    setattr(importlib.import_module(parent), leaf, module)
    try:
        exec(compile(mutant, f"<mutant of {name}>", "exec"), module.__dict__)  # noqa: S102 - the point
    except Exception:  # noqa: BLE001 - whatever it is, it has been noticed
        return 1
    # Hypothesis was imported before pytest could rewrite its asserts; they are not ours.
    rewriting = "ignore::pytest.PytestAssertRewriteWarning"
    options = ["-x", "-q", "-p", "no:cacheprovider", "--hypothesis-seed=0", "-W", rewriting]
    return int(pytest.main([*tests, *options]))


def survivors(name: str, tests: tuple[str, ...], within: str) -> Iterator[str]:
    """Yield, in words, every mutant of a module, or of a function, that its tests do not notice."""
    tree = ast.parse(Path(*name.split(".")).with_suffix(".py").read_text(encoding="utf-8"))
    if is_noticed(name, tree, tests):
        raise AssertionError(f"{' '.join(tests)} fails without any mutant")
    lines = _lines_of(tree, within)
    every = [mutant for mutant in mutants(tree) if _line(mutant[0]) in lines]
    print(f"{name}: {len(every)} mutants{f' of {within}' if within else ''}", flush=True)
    for words, mutant in every:
        if not is_noticed(name, mutant, tests):
            yield words


def _lines_of(tree: ast.Module, function: str) -> range:
    """Return where a function stands; every line where none is named."""
    if not function:
        return range(sys.maxsize)
    (found,) = (n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == function)
    return range(found.lineno, (found.end_lineno or found.lineno) + 1)


def _line(words: str) -> int:
    return int(words.partition(":")[0].removeprefix("line "))


def main() -> int:
    """Judge every mutant of every target; return how many survive without an explanation."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("modules", nargs="*", metavar="MODULE", help=", ".join(TARGETS))
    parser.add_argument("--within", default="", metavar="FUNCTION")
    chosen = parser.parse_args()
    for warm in ("numpy", "hypothesis.strategies", "drivers.ports"):
        importlib.import_module(warm)  # once, for every child
    unexplained = 0
    for name in chosen.modules or TARGETS:
        for words in survivors(name, TARGETS[name], chosen.within):
            why = EQUIVALENT.get(words.partition(": ")[2])
            unexplained += why is None
            print(f"  survived, {why or 'UNEXPLAINED'}: {words}", flush=True)
    print(f"{unexplained} survivors without an explanation")
    return unexplained


if __name__ == "__main__":
    sys.exit(min(1, main()))
