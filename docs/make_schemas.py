"""Write the JSON schemas of the YAML files into ``docs/schemas``, from the tables that their readers use."""

import json
from pathlib import Path

from minsnap.basics.schema import Form, Json, json_schema
from minsnap.batch.spec import BATCH
from minsnap.files.request_yaml import REQUEST
from minsnap.paths.missions.course import COURSE
from minsnap.shows.show_yaml import SHOW
from minsnap.vehicle.quadrotor import VEHICLE

FOLDER = Path(__file__).parent / "schemas"
FORMS: dict[str, tuple[str, Form]] = {
    "plan": ("What minsnap plan and the studio read and write", REQUEST),
    "course": ("A course with gates, laps, take-off and landing", COURSE),
    "batch": ("A data set of planned problems, drawn by a generator or from a table", BATCH),
    "vehicle": ("A quadrotor: its body, rotors and drag", VEHICLE),
    "show": ("A show of several vehicles: formations and the flights between them", SHOW),
}


def texts() -> dict[str, str]:
    """Return the content of each file by its name: a line for each key."""
    return {f"{name}.json": _text(json_schema(title, form)) + "\n" for name, (title, form) in FORMS.items()}


def _text(schema: Json) -> str:
    """Return an object, or a choice of objects, with a line for each key of each."""
    last = next(name for name in ("properties", "anyOf") if name in schema)
    head = json.dumps({name: entry for name, entry in schema.items() if name != last})[1:-1]
    if last == "anyOf":
        return f'{{{head}, "anyOf": [\n' + ",\n".join(map(_text, schema[last])) + "\n]}"
    keys = ",\n".join(f'  "{key}": {json.dumps(entry)}' for key, entry in schema[last].items())
    return f'{{{head}, "properties": {{\n{keys}\n}}}}'


if __name__ == "__main__":
    for name, text in texts().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
