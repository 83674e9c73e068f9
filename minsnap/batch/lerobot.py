"""A dataset of plans in the format LeRobot v3.0, one episode for each plan: Parquet per chunk, and ``meta/info.json``.

The format is that of the package ``lerobot`` (github.com/huggingface/lerobot, ``lerobot/datasets``). A frame holds the
state, the two waypoints ahead, and as action the setpoint of the next frame.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from minsnap.basics.arrays import FloatArray
from minsnap.basics.checks import check_number
from minsnap.basics.storage.atomic import atomic_write, make_folder, write_file
from minsnap.basics.storage.text import FileName
from minsnap.batch.columns import planned_curves
from minsnap.batch.folder import SPEC, refuse_mixed
from minsnap.batch.spec import pyarrow_parquet
from minsnap.errors import FileError
from minsnap.trajectory import Trajectory

TASK = "fly through the waypoints"
"""What every episode is labelled with."""

PER_CHUNK = 1000
"""Files of a folder at most."""

DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
"""Where the frames lie, as ``meta/info.json`` says it."""

Episodes = list[dict[str, Any]]
"""Rows of the table of episodes."""


def export_lerobot(plans: FileName, folder: FileName, fps: int = 20) -> int:
    """Write the plans of a dataset as LeRobot episodes.

    Parameters
    ----------
    plans : str or path
        Folder that :func:`minsnap.batch.run_batch` has written; its problems that were not planned are left out.
    folder : str or path
        Receives ``data/`` and ``meta/``: what ``LeRobotDataset(name, root=folder)`` reads.
    fps : int
        Frames a second.

    Returns
    -------
    int
        Number of episodes.

    Raises
    ------
    FileError
        If no problem was planned, the folder is that of a batch, or a file cannot be written.
    InputError
        If ``fps`` is no whole number from 1 to 1000.
    """
    check_number("fps", fps, 1, 1000, "give a whole number of frames a second, 1 to 1000", whole=True)
    refuse_mixed(Path(folder), SPEC)
    root, episodes, ranges = Path(folder), Episodes(), _Ranges()
    for number, part in enumerate(sorted(Path(plans).glob("part-*.parquet"))):
        frames = [_frames(curve, fps) for curve in planned_curves(part)]
        if frames:
            _write_frames(root, fps, number, frames, episodes, ranges)
    if not episodes:
        raise FileError(f"{plans} holds no plan: there is no episode to write")
    _write_meta(root, fps, episodes, ranges)
    return len(episodes)


def _frames(curve: Trajectory, fps: int) -> dict[str, FloatArray]:
    """Return the features of an episode, (frames, values) each."""
    count = int(np.floor(curve.duration * fps * (1.0 + 1e-12))) + 1
    t = np.arange(count) / fps
    then = np.minimum(t + 1.0 / fps, curve.duration)
    points, passed = curve(curve.leg_breaks), np.searchsorted(curve.leg_breaks, t, side="right")
    ahead = [points[np.minimum(passed + later, curve.legs)] for later in (0, 1)]
    return {
        "observation.state": np.hstack([curve(np.minimum(t, curve.duration), order) for order in (0, 1)]),
        "observation.environment_state": np.hstack(ahead),
        "action": np.hstack([curve(then, order) for order in (0, 1, 2)]),
    }


def _features(dim: int) -> dict[str, Any]:
    axes = "xyz"[:dim]
    place, speed, pull = ([f"{kind}{axis}" for axis in axes] for kind in ("", "v", "a"))
    ahead = [f"{axis}_of_waypoint_{later}" for later in ("ahead", "after") for axis in axes]
    names = {"observation.state": place + speed, "observation.environment_state": ahead, "action": place + speed + pull}
    own = {name: {"dtype": "float32", "shape": [len(of)], "names": of} for name, of in names.items()}
    kinds = {"timestamp": "float32"} | dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64")
    return own | {name: {"dtype": kind, "shape": [1], "names": None} for name, kind in kinds.items()}


class _Ranges:
    """Least, greatest, mean and deviation of each feature over all frames."""

    def __init__(self) -> None:
        self.known: dict[str, list[FloatArray]] = {}
        self.frames = 0

    def add(self, values: Mapping[str, FloatArray]) -> None:
        for name, table in values.items():
            new = [table.min(axis=0), table.max(axis=0), table.sum(axis=0), (table**2).sum(axis=0)]
            old = self.known.get(name, [np.inf, -np.inf, 0.0, 0.0])
            join = (np.minimum, np.maximum, np.add, np.add)
            self.known[name] = [each(*pair) for each, *pair in zip(join, old, new, strict=True)]
        self.frames += len(next(iter(values.values())))

    def plain(self) -> dict[str, dict[str, list[float]]]:
        statistics = {}
        for name, (least, most, total, squares) in self.known.items():
            mean = total / self.frames
            spread = np.sqrt(np.maximum(squares / self.frames - mean**2, 0.0))
            values = {"min": least, "max": most, "mean": mean, "std": spread}
            statistics[name] = {kind: value.tolist() for kind, value in values.items()} | {"count": [self.frames]}
        return statistics


def _write_frames(
    root: Path, fps: int, number: int, frames: list[dict[str, FloatArray]], episodes: Episodes, ranges: _Ranges
) -> None:
    """Write the frames of one file, and count its episodes."""
    import pyarrow

    chunk, file = divmod(number, PER_CHUNK)
    lengths, first = [len(one["action"]) for one in frames], len(episodes)
    start = ranges.frames
    for length in lengths:
        place = {"data/chunk_index": chunk, "data/file_index": file, "dataset_from_index": start}
        place |= {"dataset_to_index": start + length, "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}
        episodes.append({"episode_index": len(episodes), "tasks": [TASK], "length": length} | place)
        start += length
    values = {name: np.concatenate([one[name] for one in frames]) for name in frames[0]}
    index, own = np.arange(ranges.frames, start), np.concatenate([np.arange(length) for length in lengths])
    ranges.add(values)
    lists = pyarrow.FixedSizeListArray.from_arrays
    columns = {name: lists(table.astype(np.float32).ravel(), table.shape[1]) for name, table in values.items()}
    numbers = np.repeat(np.arange(first, first + len(frames)), lengths)
    columns |= {"timestamp": (own / fps).astype(np.float32), "frame_index": own, "episode_index": numbers}
    columns |= {"index": index, "task_index": np.zeros(len(index), dtype=np.int64)}
    _write_table(root / DATA.format(chunk_index=chunk, file_index=file), pyarrow.table(columns))


def _write_meta(root: Path, fps: int, episodes: Episodes, ranges: _Ranges) -> None:
    import pandas
    import pyarrow

    tasks = pyarrow.Table.from_pandas(pandas.DataFrame({"task_index": [0]}, index=[TASK]))
    _write_table(root / "meta/episodes/chunk-000/file-000.parquet", pyarrow.Table.from_pylist(episodes))
    _write_table(root / "meta/tasks.parquet", tasks)
    width, count = len(ranges.known["observation.state"][0]), len(episodes)
    info = {
        "codebase_version": "v3.0",
        "robot_type": "quadrotor",
        "total_episodes": count,
        "total_frames": ranges.frames,
        "total_tasks": 1,
        "chunks_size": PER_CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": fps,
        "splits": {"train": f"0:{count}"},
        "data_path": DATA,
        "video_path": None,
        "features": _features(width // 2),
    }
    for name, value in (("info", info), ("stats", ranges.plain())):
        write_file(root / f"meta/{name}.json", json.dumps(value, indent=1) + "\n")


def _write_table(path: Path, table: Any) -> None:
    make_folder(path.parent)
    with atomic_write(path, "wb") as file:
        pyarrow_parquet().write_table(table, file)
