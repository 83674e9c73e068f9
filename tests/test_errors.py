"""The errors: one family, exported, with every attribute declared where a reader finds it."""

import ast
import copy
import pickle
import re
from pathlib import Path

import pytest

import minsnap
from minsnap import errors
from minsnap.basics.deadline import LateError

ALL = {name: value for name, value in vars(errors).items() if getattr(value, "__module__", "") == errors.__name__}
PACKAGE = Path(minsnap.__file__).parent


def raised_evidence():
    """Return (class, keyword, where) of every call of an error's class in the package."""
    found = []
    for path in PACKAGE.rglob("*.py"):
        for call in (node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call)):
            name = getattr(call.func, "id", getattr(call.func, "attr", None))
            if name in ALL:
                found += [(ALL[name], word.arg, f"{path.name}:{call.lineno}") for word in call.keywords]
    return found


def test_every_error_is_of_the_family():
    assert len(ALL) > 20
    for name, value in ALL.items():
        assert getattr(minsnap.errors, name) is value
        assert issubclass(value, minsnap.MinsnapError) or issubclass(value, Warning)


PAGE = (PACKAGE.parent / "docs" / "when_something_is_wrong.rst").read_text(encoding="utf-8")


def test_every_error_has_a_heading_that_says_what_to_do():
    for kind in (value for value in ALL.values() if issubclass(value, minsnap.MinsnapError)):
        code = kind("").code
        assert f".. _wrong-{code}:\n\n{code}\n{'-' * len(code)}\n" in PAGE, kind


@pytest.mark.slow
def test_what_that_page_quotes_is_what_errors_say():
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in PACKAGE.rglob("*.py")]
    constants = [node.value for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    texts = [text for text in constants if isinstance(text, str)]
    quoted = re.findall(r'\*"([^"]+)"\*', PAGE)
    assert len(quoted) > 30
    assert [words for words in quoted if not any(" ".join(words.split()) in text for text in texts)] == []


def test_an_error_of_a_room_has_the_heading_of_its_family():
    assert LateError("late").code == "solver"


@pytest.mark.slow
def test_every_attribute_that_an_error_is_given_is_declared_and_documented():
    given = raised_evidence()
    assert (errors.UnprovedError, "shortest") in {(kind, name) for kind, name, _ in given}
    for kind, name, where in given:
        assert name is None or hasattr(kind, name), where
        assert name is None or any(name in (parent.__doc__ or "") for parent in kind.__mro__[:-3]), where


def test_an_attribute_that_is_not_declared_is_a_mistake_of_the_program():
    with pytest.raises(TypeError, match="TimingError declares no attribute 'width'"):
        errors.TimingError("a sentence", width=1.0)


def test_attributes_are_none_unless_given():
    assert errors.InfeasibleError("a sentence").smallest_width is None
    assert errors.InfeasibleError("a sentence", smallest_width=0.2).smallest_width == 0.2
    assert str(errors.InfeasibleError("a sentence", leg=2)) == "a sentence"


REFUSED = {
    "walls": {"durations": [2.0, 2.0], "corridor": 0.01, "continuity": 6, "pieces": 1},
    "lengths": {"total_time": 0.1, "limits": minsnap.Limits(speed=3.0)},
    "pins": {"durations": [2.0, 2.0], "degree": 3, "continuity": 2, "pins": {1: {"velocity": (0.0, 0.0, 1.0)}}},
}


@pytest.mark.parametrize("kind", REFUSED)
def test_an_error_passes_from_process_to_process_with_its_proof(kind):
    with pytest.raises(minsnap.InfeasibleError) as caught:
        minsnap.plan([(0, 0, 1), (4, 0, 1), (4, 3, 1)], **REFUSED[kind])
    for twin in (pickle.loads(pickle.dumps(caught.value)), copy.deepcopy(caught.value)):
        assert type(twin) is type(caught.value) and str(twin) == str(caught.value)
        assert vars(twin).keys() == vars(caught.value).keys() and twin.contradiction.verify()
