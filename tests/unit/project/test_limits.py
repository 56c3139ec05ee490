"""No module, folder or function is larger than a reader can hold; CONTRIBUTING.md has the limits."""
import ast
from collections import Counter

import pytest

from development import PACKAGES, ROOT

MODULE_LINES, FUNCTION_LINES, ARGUMENTS, MODULES = 400, 50, 6, 14
FOLDERS = (*(folder / 'src' for folder in PACKAGES.values()), ROOT / 'development')
SUFFIXES = ('.py', '.cpp', '.h')
FILES = sorted(path for folder in FOLDERS for path in folder.rglob('*') if path.suffix in SUFFIXES)


def functions(text):
    """Yield name, lines and number of arguments of each function, self and cls not counted."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            names = [each.arg for each in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
            yield node.name, node.end_lineno - node.lineno + 1, len(names) - names.count('self') - names.count('cls')


def test_functions_are_measured():
    text = 'class A:\n    def f(self, a, *, b):\n        return a\n\ndef g():\n    pass\n'
    assert sorted(functions(text)) == [('f', 2, 2), ('g', 2, 0)]


def test_there_are_modules():
    assert len(FILES) > 150


@pytest.mark.parametrize('path', FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_module(path):
    text = path.read_text()
    assert len(text.splitlines()) <= MODULE_LINES
    if path.suffix == '.py':
        assert [each for each in functions(text) if each[1] > FUNCTION_LINES or each[2] > ARGUMENTS] == []


def test_folders():
    modules = Counter(path.parent for path in FILES if path.name != '__init__.py')
    assert {str(folder): number for folder, number in modules.items() if number > MODULES} == {}


@pytest.mark.parametrize('pattern', ['tests/unit/*/test_*.py', 'tests/openpose*/test_*.py'])
def test_names_of_test_files_differ(pattern):
    """Pytest imports those of one run by their names alone."""
    names = Counter(path.name for path in ROOT.glob(pattern) if 'devel' not in path.parts and 'build' not in path.parts)
    assert [name for name, number in names.items() if number > 1] == []
    assert len(names) > 10
