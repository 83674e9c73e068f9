"""Properties that are computed once: no thread waits for another one's."""

import ast
from pathlib import Path
from threading import Event, Thread

import minsnap
from minsnap.basics.cached import cached_property


class Asked:
    """A value that waits for what it is made of."""

    def __init__(self, ready):
        self.ready, self.begun, self.times = ready, Event(), 0

    @cached_property
    def value(self):
        """What was computed."""
        self.times += 1
        self.begun.set()
        assert self.ready.wait(60.0)
        return object()


def test_a_value_is_computed_once():
    ready = Event()
    ready.set()
    asked = Asked(ready)
    assert asked.value is asked.value and asked.times == 1
    assert Asked.value.__doc__ == "What was computed."


def test_no_instance_waits_for_another_one():
    """One lock for all instances, as before Python 3.12, is held in a process that is forked meanwhile, for ever."""
    never, ready = Event(), Event()
    ready.set()
    waiting, other = Asked(never), Asked(ready)
    thread = Thread(target=lambda: waiting.value)
    thread.start()
    assert waiting.begun.wait(60.0)
    beside = Thread(target=lambda: other.value, daemon=True)
    beside.start()
    beside.join(30.0)
    computed = not beside.is_alive()
    never.set()
    thread.join()
    assert computed


def test_no_module_takes_the_one_with_a_lock():
    for path in Path(minsnap.__file__).parent.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            taken = isinstance(node, ast.ImportFrom) and node.module == "functools"
            if taken and path.name != "cached.py":
                assert "cached_property" not in {name.name for name in node.names}, path
