"""What the command that checks files says of a fleet."""

from __future__ import annotations

import json as jsonlib
from pathlib import Path
from typing import TYPE_CHECKING

from minsnap.basics.checks import point_text
from minsnap.basics.storage.text_columns import aligned, labelled
from minsnap.errors import InputError

if TYPE_CHECKING:
    from minsnap.fleet.fleet_certificate import FleetCertificate

LISTED = 10
"""Pairs that are shown."""


def check_fleet(path: Path, separation: float | None, downwash: float, json: bool) -> int:
    """Print how far apart the vehicles of files stay, over all time; return 1 if that is less than their separation."""
    from minsnap.fleet.common_clock import Separation
    from minsnap.fleet.fleet_certificate import certify_fleet
    from minsnap.shows.fleet_files import read_fleet

    fleet = read_fleet(path)
    apart = fleet.separation if separation is None else Separation(separation, downwash)
    if apart is None:
        raise InputError(f"{path} does not say how far apart its vehicles must be: give --separation M")
    certificate = certify_fleet(fleet, apart)
    print(_as_json(certificate) if json else _as_text(certificate))
    return 0 if certificate.ok else 1


def pair_rows(certificate: FleetCertificate, most: int = LISTED) -> list[list[str]]:
    """Return the pairs that come nearest, as rows of text under a heading."""
    rows = [["vehicles", "", "distance [m]", "separation [m]", "at [s]", "between [m]"]]
    for near in certificate.nearest[:most]:
        names = [certificate.fleet.name(vehicle) for vehicle in near.pair]
        figures = f"{near.distance:.4f}", f"{near.required:.4g}", f"{near.instant:.2f}"
        rows.append([*names, *figures, point_text(certificate.middle_of(near).round(2) + 0.0)])
    return rows


def _as_text(certificate: FleetCertificate) -> str:
    fleet = certificate.fleet
    fastest = max(curve.max_norm(1)[0] for curve in fleet)
    hardest = max(curve.max_norm(2)[0] for curve in fleet)
    lines = [("vehicles", str(len(fleet))), ("duration", f"{fleet.duration:.6g} s")]
    lines += [("top speed", f"{fastest:.4g} m/s"), ("top acceleration", f"{hardest:.4g} m/s^2")]
    table = ["", aligned(pair_rows(certificate))] if certificate.nearest else []
    return "\n".join([labelled(lines), *table, "", _verdict(certificate)])


def _verdict(certificate: FleetCertificate) -> str:
    if certificate.least_distance is None or certificate.pair is None or certificate.instant is None:
        return "one vehicle: there is no pair"
    first, second = (certificate.fleet.name(vehicle) for vehicle in certificate.pair)
    nearest = f"{first} and {second} come within {certificate.least_distance:.4f} m at {certificate.instant:.2f} s"
    return f"apart at every instant: {nearest}" if certificate.ok else f"problem: {nearest}"


def _as_json(certificate: FleetCertificate) -> str:
    near = [vars(pair) | {"between": certificate.middle_of(pair).tolist()} for pair in certificate.nearest]
    fleet = certificate.fleet
    return jsonlib.dumps(
        {
            "ok": certificate.ok,
            "vehicles": [fleet.name(i) for i in range(len(fleet))],
            "duration": fleet.duration,
            "least_distance": certificate.least_distance,
            "pair": certificate.pair,
            "instant": certificate.instant,
            "nearest": near,
        },
        indent=2,
    )
