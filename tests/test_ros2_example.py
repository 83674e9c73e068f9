"""The example of a ROS 2 node fills messages with the plan in NED."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np

NODE = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "ros2_node.py"))


def test_a_message_has_the_fields_of_its_row_as_plain_python_values():
    samples = NODE["planned"]()
    rows = NODE["px4_setpoints"](samples)
    for k in (0, len(rows) // 2, len(rows) - 1):
        sent = NODE["filled"](SimpleNamespace(), rows[k])
        east, north, up = samples.position[k]
        assert np.allclose(sent.position, [north, east, -up], atol=1e-5)
        assert np.isclose(np.exp(1j * sent.yaw), np.exp(1j * (np.pi / 2 - samples.yaw[k])), atol=1e-5)
        assert isinstance(sent.timestamp, int) and isinstance(sent.position, list) and isinstance(sent.yaw, float)
