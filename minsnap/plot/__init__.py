"""Figures of paths in the plane or in space and against time; matplotlib is imported when a figure is drawn."""

from minsnap.plot.animation import animate_fleet, animate_path
from minsnap.plot.figures import plot_overview, save_figure
from minsnap.plot.fleet_figures import plot_fleet, plot_separation
from minsnap.plot.geometry import plot_path
from minsnap.plot.limit_use import plot_convergence, plot_utilisation
from minsnap.plot.mission_figure import plot_mission
from minsnap.plot.profiles import plot_heading, plot_profiles
from minsnap.plot.race import plot_race, plot_rotors
from minsnap.plot.route_figure import plot_route
from minsnap.plot.style import styled

__all__ = [
    "animate_fleet",
    "animate_path",
    "plot_convergence",
    "plot_fleet",
    "plot_mission",
    "plot_separation",
    "plot_heading",
    "plot_overview",
    "plot_path",
    "plot_profiles",
    "plot_race",
    "plot_rotors",
    "plot_route",
    "plot_utilisation",
    "save_figure",
    "styled",
]
