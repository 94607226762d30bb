"""Numbers that decide stand in one place each, with why, and somebody uses them."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import fieldcal
from fieldcal.core.samples import CHANNELS

HERE = Path(fieldcal.__file__).parent
ESTIMATION = ("model", "diagnosis", "solve")
CONSTANTS = ("priors", "thresholds", "detections", "tolerances", "resolutions")


def assigned(path: Path) -> Iterator[tuple[list[str], ast.expr, ast.stmt | None]]:
    """Names that a module assigns, their value, and the statement that follows."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    for node, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            at = node.target if isinstance(node, ast.AnnAssign) else node.targets[0]
            names = [n.id for n in ast.walk(at) if isinstance(n, ast.Name)]
            yield names, node.value, after


def is_number(value: ast.expr) -> bool:
    """Whether a value is written as numbers: alone, calculated, or in a table.

    What is derived from another constant is none: there that one decides. Nor is a
    table of numbers with their names: it says what is counted how.
    """
    match value:
        case ast.Constant(value=bool()):
            return False
        case ast.Constant():
            return isinstance(value.value, int | float)
        case ast.UnaryOp():
            return is_number(value.operand)
        case ast.BinOp():
            return is_number(value.left) and is_number(value.right)
        case ast.Tuple() | ast.List() | ast.Set():
            return bool(value.elts) and all(map(is_number, value.elts))
        case ast.Dict():
            return bool(value.values) and all(map(is_number, value.values))
        case ast.Call(func=ast.Attribute() | ast.Name() as made):
            name = made.attr if isinstance(made, ast.Attribute) else made.id
            shaped = name in ("empty", "zeros", "ones", "field")
            return not shaped and any(map(is_number, value.args))
    return ast.unparse(value) in ("np.pi", "np.inf", "math.pi", "math.inf")


def is_no_decision(value: ast.expr) -> bool:
    """Numbers by which nothing is decided: mathematics, and indices of outputs.

    Outputs are counted from 0 to 5, and 6 is the closure of turns; groups of them are
    tuples in a tuple. Of mathematics there are pi and roots of whole numbers.
    """
    text = ast.unparse(value)
    if "np.pi" in text or text.startswith("np.sqrt("):
        return True
    groups = value.elts if isinstance(value, ast.Tuple) else []
    grouped = all(isinstance(g, ast.Tuple) for g in groups)
    return bool(groups) and grouped and max_index(value) <= len(CHANNELS)


def max_index(value: ast.expr) -> float:
    """The largest of the whole numbers of a table; infinite if it has others."""
    leaves = [n.value for n in ast.walk(value) if isinstance(n, ast.Constant)]
    whole = [n for n in leaves if isinstance(n, int)]
    return max(whole) if whole and len(whole) == len(leaves) else float("inf")


@pytest.mark.parametrize(
    ("text", "stands"),
    [
        ("3.0", True), ("-1e-3", True), ("1 << 16", True), ("(0.5, 2)", True),
        ("float(np.deg2rad(0.2))", True), ("np.repeat([0.3, 2e-2], 3)", True),
        ("{'acc_bias': 1.0}", True), ("((0, 1), (2, 7))", True), ("(0, 1, 2)", True),
        ("'angle'", False), ("True", False), ("priors.SCALE / 2", False),
        ("(('acc', (0, 1)), ('gyr', (3, 4)))", False), ("(NO_SHAPE, 0)", False),
        ("SIZES[[14, 17]]", False), ("np.empty((0, 1))", False), ("np.sqrt(2)", False),
        ("((0, 1, 2), (3, 4, 5, 6))", False), ("np.pi / 180", False),
        ("{1: 'one degree of freedom'}", False),
    ],
)  # fmt: skip
def test_what_counts_as_a_number_that_decides(text: str, stands: bool) -> None:
    value = ast.parse(text, mode="eval").body
    assert (is_number(value) and not is_no_decision(value)) == stands


def test_no_other_module_states_a_number() -> None:
    stated = []
    for path in (p for one in ESTIMATION for p in (HERE / one).rglob("*.py")):
        if path.parent.name != "model" or path.stem not in CONSTANTS:
            stated += [
                f"{path.relative_to(HERE)}: {', '.join(names)} = {ast.unparse(value)}"
                for names, value, _ in assigned(path)
                if is_number(value) and not is_no_decision(value)
            ]
    assert not stated, f"in {' or '.join(CONSTANTS)}, with why: {stated}"


@pytest.mark.parametrize("module", CONSTANTS)
def test_each_says_why_and_is_used(module: str) -> None:
    path = HERE / "model" / f"{module}.py"
    everywhere = "\n".join(p.read_text(encoding="utf-8") for p in HERE.rglob("*.py"))
    used = {*re.findall(rf"\b{module}\.([A-Z_0-9]+)\b", everywhere)}
    used |= {
        node.id
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }
    for names, _, after in assigned(path):
        said = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
        assert said, f"{names}: why?"
        assert used >= {*names}, f"nobody uses {names}"


def test_no_name_stands_in_two_of_them() -> None:
    paths = [HERE / "model" / f"{module}.py" for module in CONSTANTS]
    names = [name for path in paths for some, *_ in assigned(path) for name in some]
    assert sorted(names) == sorted(set(names))
