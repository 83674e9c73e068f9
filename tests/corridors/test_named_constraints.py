"""The names under which files hold constraints."""

import minsnap
from minsnap.corridors.named_constraints import CONSTRAINTS


def test_every_constraint_of_the_library_can_be_saved_by_name():
    public = {name: getattr(minsnap, name) for name in minsnap.__all__}
    of_corridors = {
        name: kind
        for name, kind in public.items()
        if isinstance(kind, type) and hasattr(kind, "walls") and kind.__module__.startswith("minsnap.corridors")
    }
    assert of_corridors == CONSTRAINTS
