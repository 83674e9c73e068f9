"""Write the JSON schemas of the YAML files into ``docs/schemas``, from the tables that their readers use."""

import json
from pathlib import Path

from minsnap.files.request_yaml import REQUEST
from minsnap.files.schema import Form, json_schema
from minsnap.paths.missions.course_file import COURSE
from minsnap.shows.show_yaml import SHOW

FOLDER = Path(__file__).parent / "schemas"
FORMS: dict[str, tuple[str, Form]] = {
    "plan": ("What minsnap plan and the studio read and write", REQUEST),
    "course": ("A course with gates, laps, take-off and landing", COURSE),
    "show": ("A show of several vehicles: formations and the flights between them", SHOW),
}


def texts() -> dict[str, str]:
    """Return the content of each file by its name: a line for each key."""
    found = {}
    for name, (title, form) in FORMS.items():
        schema = json_schema(title, form)
        keys = ",\n".join(f'  "{key}": {json.dumps(entry)}' for key, entry in schema.pop("properties").items())
        found[f"{name}.json"] = f'{json.dumps(schema)[:-1]}, "properties": {{\n{keys}\n}}}}\n'
    return found


if __name__ == "__main__":
    for name, text in texts().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
