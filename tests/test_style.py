"""Rules of docs/decisions and the style that no linter knows."""

import ast
from pathlib import Path

import pytest

SOURCE = Path(__file__).parent.parent / "src/moldline"
MODULES = sorted(p for p in SOURCE.rglob("*.py") if p.name != "_version.py")
TREES = {path: ast.parse(path.read_text()) for path in MODULES}


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SOURCE)))
def test_a_module_is_short_and_says_what_is_in_it(path):
    assert len(path.read_text().splitlines()) < 400
    assert ast.get_docstring(TREES[path])
    assert path.stem not in {"utils", "helpers", "common", "misc"}


def test_functions_are_short():
    for path, tree in TREES.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef) and not path.stem.endswith("_loops"):
                first = node.body[1] if ast.get_docstring(node) and len(node.body) > 1 else node
                length = node.end_lineno - first.lineno
                assert length < 45, f"{path.name}: {node.name} has {length} lines"


def test_classes_are_abstract_or_final():
    classes = {
        n.name: n for t in TREES.values() for n in ast.walk(t) if isinstance(n, ast.ClassDef)
    }
    for node in classes.values():
        for base in node.bases:
            name = base.id if isinstance(base, ast.Name) else ""
            if name in classes and name not in {"Table", "_Closed", "MoldlineError"}:
                assert name.startswith("Abstract"), f"{node.name} derives from {name}"


def test_no_super():
    for path, tree in TREES.items():
        calls = [n for n in ast.walk(tree) if isinstance(n, ast.Name) and n.id == "super"]
        assert not calls, path
