"""Figures of fleets: paths from above coloured by time, and the least distance of any pair against time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from minsnap.basics.arrays import FloatArray, IntArray
from minsnap.basics.checks import check_kind
from minsnap.corridors import Avoided
from minsnap.errors import FleetError
from minsnap.fleet import Fleet, FleetCertificate, Separation
from minsnap.plot.obstacles import draw_obstacles
from minsnap.plot.style import Axes, new_axes, styled

INSTANTS = 401
"""Instants at which paths and distances are drawn; what is proved is drawn beside them."""

NEAR_FACTOR = 1.25
"""Vehicles nearer than this times their separation are shown as near."""

LARGEST = (7.0, 4.8)
"""Most that the paths take of a figure, width and height [in]."""

MANY = 30
"""Vehicles above which their paths are drawn as pixels in files of lines, which would be large."""

NUMBERED = 400
"""Vehicles above which homes have no numbers, which would not be readable."""

VIEWS = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


@styled
def plot_fleet(fleet: Fleet, view: str = "xy", ax: Axes | None = None, *, avoid: Sequence[Avoided] = ()) -> Axes:
    """Draw the paths of all vehicles, coloured by time, with their ends.

    Parameters
    ----------
    fleet : Fleet
    view : {"xy", "xz", "yz"}
        From above, or from a side.
    ax : Axes, optional
        By default new ones.
    avoid : sequence of Obstacle
        Those of :func:`minsnap.plan_fleet`; drawn as shadows.

    Raises
    ------
    FleetError
        If the view is not one of these, or the fleet has no such coordinate.
    """
    from matplotlib.collections import LineCollection

    check_kind("fleet", fleet, Fleet, "a Fleet")
    if view not in VIEWS or max(VIEWS[view]) >= fleet.dim:
        raise FleetError(f"view is {view!r}: choose one of xy, xz, yz, of which the vehicles have coordinates")
    t = np.linspace(0.0, fleet.duration, INSTANTS)
    places = fleet(t)[:, :, VIEWS[view]]
    axes = new_axes(size=_size_for(places)) if ax is None else ax
    draw_obstacles(axes, avoid, VIEWS[view], places.reshape(-1, 2))
    steps = np.stack([places[:, :-1], places[:, 1:]], axis=2).reshape(-1, 2, 2)
    lines = LineCollection(list(steps), array=np.tile(t[:-1], len(fleet)), cmap="viridis", linewidths=0.8)
    lines.set_rasterized(len(fleet) > MANY)
    axes.add_collection(lines)
    axes.plot(*places[:, 0].T, "o", color="0.2", markersize=3, label="start")
    axes.plot(*places[:, -1].T, "x", color="tab:red", markersize=4, label="end")
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.set(xlabel=f"{view[0]} [m]", ylabel=f"{view[1]} [m]")
    axes.figure.colorbar(lines, ax=axes, label="time [s]", fraction=0.046, pad=0.03, aspect=30)
    legend_above(axes)
    return axes


@styled
def plot_homes(fleet: Fleet, ax: Axes | None = None) -> Axes:
    """Draw where the vehicles stand, from above, with their numbers.

    Parameters
    ----------
    fleet : Fleet
        Named vehicles have the last word of their names in place of numbers.
    ax : Axes, optional
        By default new ones.
    """
    axes = new_axes() if ax is None else ax
    places = fleet(0.0)[:, :2]
    axes.plot(*places.T, "o", color="0.88", markersize=12 if len(fleet) <= MANY else 5)
    for vehicle, place in enumerate(places if len(fleet) <= NUMBERED else []):
        text = fleet.name(vehicle).rpartition(" ")[2]
        axes.annotate(text, place, ha="center", va="center", fontsize=7 if len(fleet) <= 4 * MANY else 4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.1)
    axes.set(xlabel="x [m]", ylabel="y [m]", title="homes")
    return axes


def legend_above(axes: Axes) -> None:
    """Say what the marks are, in a line above the axes."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, columnspacing=1.0, frameon=False)


def _size_for(places: FloatArray) -> tuple[float, float]:
    """Return the size of a figure [in] of which places (vehicles, n, 2) in equal scales fill most."""
    wide, high = np.ptp(places.reshape(-1, 2), axis=0)
    shaped = (LARGEST[1] * wide / max(high, 1e-9), LARGEST[0] * high / max(wide, 1e-9))
    width, height = np.clip(shaped, 2.0, LARGEST)
    return float(width) + 2.0, float(height) + 0.9


@styled
def plot_separation(certificate: FleetCertificate, ax: Axes | None = None) -> Axes:
    """Draw the least distance of any two vehicles against time, what it is to be, and what was proved.

    Parameters
    ----------
    certificate : FleetCertificate
        Of two vehicles or more, with a separation.
    ax : Axes, optional
        By default new ones.

    Raises
    ------
    FleetError
        If there is no pair.
    """
    separation = certificate.separation
    near = certificate.closest
    if near is None or separation is None:
        raise FleetError("a fleet of one vehicle has no distance to draw: give two vehicles and a separation")
    axes = new_axes() if ax is None else ax
    t = np.linspace(0.0, certificate.fleet.duration, INSTANTS)
    axes.plot(t, least_distances(certificate.fleet, separation, t), color="tab:blue", label="nearest pair, sampled")
    apart = separation.between(*near.pair)
    axes.axhline(apart, color="tab:red", linestyle="--", label=f"separation, {apart:g} m")
    axes.plot(near.instant, near.distance, "o", color="tab:orange", label=f"proved least, {near.distance:.3f} m")
    what = "distance [m]" if separation.downwash == 1.0 else "distance, heights by the downwash [m]"
    axes.set(xlabel="time [s]", ylabel=what, xlim=(0.0, certificate.fleet.duration), ylim=(0.0, None))
    axes.legend(loc="lower left", framealpha=0.9)  # below the separation there is no curve
    return axes


def least_distances(fleet: Fleet, separation: Separation, t: FloatArray) -> FloatArray:
    """Return the least distance of any two vehicles at instants (n,), heights divided by the downwash, shape (n,)."""
    from scipy.spatial import KDTree

    places = separation.flat(fleet(t))
    return np.array([KDTree(places[:, i]).query(places[:, i], k=2)[0][:, 1].min() for i in range(len(t))])


def near_pairs(places: FloatArray, separation: Separation) -> IntArray:
    """Return the pairs of vehicles at places (vehicles, dim) nearer than 1.25 times their separation, (pairs, 2)."""
    from scipy.spatial import KDTree

    radii, flat = NEAR_FACTOR * separation.radii_of(len(places)), separation.flat(places)
    pairs = KDTree(flat).query_pairs(2.0 * radii.max(), output_type="ndarray")
    one, two = pairs.T
    kept = np.linalg.norm(flat[one] - flat[two], axis=1) < radii[one] + radii[two]
    return np.asarray(pairs[kept])
