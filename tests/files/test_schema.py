"""Forms of values in files: what they read and refuse, and the JSON schemas that are made of them."""

import json
import runpy
from pathlib import Path

import pytest

from minsnap.basics.schema import FLAG, NUMBER, WHOLE, Key, either, mapping, several, word
from minsnap.errors import FileError
from minsnap.files.limits_yaml import LIMITS

DOCS = Path(__file__).parents[2] / "docs"


def test_the_schemas_of_the_docs_are_those_of_the_readers():
    written = {file.name: file.read_text() for file in (DOCS / "schemas").glob("*.json")}
    made = runpy.run_path(str(DOCS / "make_schemas.py"))["texts"]()
    assert written == made, "run python docs/make_schemas.py"
    assert json.loads(written["course.json"])["properties"]["laps"]["type"] == "integer"


@pytest.mark.parametrize(
    ("form", "value", "read"),
    [
        (NUMBER, 3, 3.0),
        (several(NUMBER, "numbers", 1), [1, 2], (1.0, 2.0)),
        (either(word("auto"), WHOLE), "auto", "auto"),
        (word("long", short={"l": "long"}), "l", "long"),
        (mapping({"a": Key(FLAG), "b": Key(NUMBER)}, "a mapping"), {"a": True, "b": None}, {"a": True}),
        (LIMITS, {"speed": 3, "tilt": None}, {"speed": 3.0, "tilt": None}),
    ],
)
def test_values_of_a_form_are_read(form, value, read):
    assert form.read("here", value) == read


@pytest.mark.parametrize(
    ("form", "value", "said"),
    [
        (NUMBER, True, "here is True: give a finite number"),
        (WHOLE, 2.5, "here is 2.5: give a whole number"),
        (several(NUMBER, "two numbers", 2, 2), [1], "give two numbers"),
        (several(NUMBER, "two numbers", 2, 2), [1, "b"], "here 1 is 'b': give a finite number"),
        (either(word("auto"), WHOLE), "many", "give one of auto, or a whole number"),
        (mapping({"laps": Key(WHOLE)}, "a mapping"), {"lap": 1}, "'lap' is not known: did you mean laps"),
        (mapping({"laps": Key(WHOLE, needed=True)}, "a mapping"), {}, "here has no laps: give it"),
        (LIMITS, {None: 1}, "here: None is not known"),
        (LIMITS, {"rotors": {"reserve": 0.1}}, "here: rotors has no vehicle"),
    ],
)
def test_other_values_are_refused_where_they_stand(form, value, said):
    with pytest.raises(FileError, match=said):
        form.read("here", value)
