"""Where ROS 2 is not installed its interfaces are stood in for."""

import sys
from importlib.util import find_spec
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

if find_spec("rclpy") is None:
    import stand_ins

    stand_ins.install()
