"""Geofences of QGroundControl's plan files: polygons and circles to keep inside of and out of, in metres.

The part ``geoFence`` of https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html: ``polygons``
and ``circles``, each with ``inclusion``. Degrees become metres east and north of ``plannedHomePosition``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from minsnap.basics.arrays import ArrayLike, FloatArray
from minsnap.basics.checks import check_array
from minsnap.basics.messages import explains_names
from minsnap.basics.storage.text import FileName, read_text, reading
from minsnap.corridors.keep_out import Avoided, Cylinder
from minsnap.corridors.prism import Prism
from minsnap.errors import FileError, InputError
from minsnap.files.geodesy import local_positions


@explains_names({})
def read_fence(path: FileName, origin: ArrayLike | None = None) -> tuple[Avoided, ...]:
    """Return the geofence of a QGroundControl plan as ``plan`` takes it in ``avoid``.

    Parameters
    ----------
    path : str or path
        A ``.plan`` file.
    origin : array_like, shape (3,), optional
        Latitude, longitude [degrees] and height [m] of the origin of the metres; by default the planned home.

    Returns
    -------
    tuple of Prism and Cylinder
        Prisms without ends; a circle to keep out of is a cylinder, one to keep inside of a polygon of 90 corners in it.

    Raises
    ------
    FileError
        If it is no such file, has no fence, or no home where no origin is given.
    InputError
        If the origin is malformed.
    """
    text = read_text(path)
    with reading(path, "a plan of QGroundControl"):
        content = json.loads(text)
        fence = content["geoFence"] if content.get("fileType") == "Plan" else None
        home = content.get("mission", {}).get("plannedHomePosition") if fence is not None else None
    if not isinstance(fence, Mapping):
        raise FileError(f"{path} is no plan of QGroundControl: it has no fileType 'Plan', or no geoFence")
    if origin is None and home is None:
        raise FileError(f"{path} has no plannedHomePosition: give the origin of the metres")
    given = home if origin is None else origin
    at = check_array("the origin of a fence", given, ((3,),), "latitude, longitude and height", InputError)
    with reading(path, "a geofence"):
        found = [*(_polygon(each, at) for each in fence.get("polygons", ()))]
        found += [_circle(each, at) for each in fence.get("circles", ())]
    if not found:
        raise FileError(f"{path} has a geofence without polygons and circles: draw one, or leave it out")
    return tuple(found)


def _polygon(entry: Mapping[str, Any], home: FloatArray) -> Avoided:
    return Prism(_metres(entry["polygon"], home), inclusion=bool(entry["inclusion"]))


def _circle(entry: Mapping[str, Any], home: FloatArray) -> Avoided:
    circle = entry["circle"]
    (center,), radius = _metres([circle["center"]], home), float(circle["radius"])
    return Prism.circle(center, radius, inclusion=True) if entry["inclusion"] else Cylinder(center, radius)


def _metres(places: Any, home: FloatArray) -> FloatArray:
    """Return latitudes and longitudes (n, 2) as metres east and north of the home, at its height."""
    degrees = np.array(places, dtype=np.float64).reshape(-1, 2)
    return local_positions(np.column_stack((degrees, np.full(len(degrees), home[2]))), home)[:, :2]
