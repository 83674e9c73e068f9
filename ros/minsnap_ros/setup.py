"""Installed by colcon; the library itself by pip, see README.md."""

from setuptools import setup

setup(
    name="minsnap_ros",
    version="0.2.0",
    packages=["minsnap_ros"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/minsnap_ros"]),
        ("share/minsnap_ros", ["package.xml"]),
    ],
    install_requires=["setuptools", "minsnap>=0.2"],
    entry_points={"console_scripts": ["planner = minsnap_ros.planner_node:main"]},
)
