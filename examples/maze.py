"""From the picture of a maze to setpoints: free pixels, a path, boxes along it, the curve through them, a CSV.

The picture is read as an occupancy grid, dark pixels being walls. A search finds a way through pixels that are far
enough from them, boxes are inflated along it, and the curve passes from box to box where it costs least.
"""

import sys
from collections import deque
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.image import imread, imsave
from matplotlib.patches import Rectangle
from scipy.ndimage import distance_transform_edt

import minsnap
from minsnap.plot import save_figure, styled

PIXEL, RADIUS = 0.1, 0.25
CELLS, PASSAGE, WALL = (8, 6), 12, 2


def draw_maze(file: Path, seed: int = 5) -> None:
    """Write a picture of a maze, by a walk that turns back where it is stuck."""
    pitch = PASSAGE + WALL
    picture = np.zeros((CELLS[1] * pitch + WALL, CELLS[0] * pitch + WALL))
    draw, trail, seen = np.random.default_rng(seed), [(0, 0)], {(0, 0)}
    while trail:
        x, y = trail[-1]
        picture[y * pitch + WALL : (y + 1) * pitch, x * pitch + WALL : (x + 1) * pitch] = 1.0
        ways = [(x + dx, y + dy) for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1))]
        ways = [w for w in ways if w not in seen and 0 <= w[0] < CELLS[0] and 0 <= w[1] < CELLS[1]]
        if not ways:
            trail.pop()
            continue
        new = ways[draw.integers(len(ways))]
        seen.add(new)
        trail.append(new)
        low, high = (min(x, new[0]), min(y, new[1])), (max(x, new[0]), max(y, new[1]))
        picture[low[1] * pitch + WALL : (high[1] + 1) * pitch, low[0] * pitch + WALL : (high[0] + 1) * pitch] = 1.0
    imsave(file, picture, cmap="gray", vmin=0.0, vmax=1.0)


def find_path(free: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> np.ndarray:
    """Shortest way through free cells from face to face, (m, 2) in cells."""
    came, queue = {start: start}, deque([start])
    while queue and goal not in came:
        cell = queue.popleft()
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            new = (cell[0] + dx, cell[1] + dy)
            if 0 <= new[0] < free.shape[0] and 0 <= new[1] < free.shape[1] and free[new] and new not in came:
                came[new] = cell
                queue.append(new)
    path = [goal]
    while path[-1] != start:
        path.append(came[path[-1]])
    return np.array(path[::-1])


@styled
def main(folder: Path) -> None:
    """Go from start to goal, and write the setpoints and a figure."""
    folder.mkdir(parents=True, exist_ok=True)
    draw_maze(folder / "maze_picture.png")
    walls = imread(folder / "maze_picture.png")[::-1, :, 0].T < 0.5
    inner = distance_transform_edt(~walls) * PIXEL > RADIUS + 1.5 * PIXEL
    corner = WALL + PASSAGE // 2
    cells = find_path(inner, (corner, corner), (walls.shape[0] - corner, walls.shape[1] - corner))
    found = minsnap.corridor_from_grid(walls, PIXEL, (cells + 0.5) * PIXEL, clearance=RADIUS)
    legs = len(found.boxes)
    trajectory = minsnap.plan(
        None,
        total_time=1.5 * legs,
        corridor=found.boxes,
        start=found.start,
        end=found.end,
        search=minsnap.Search(split="distance"),
    )
    minsnap.write_csv(trajectory, folder / "maze.csv")
    figure = Figure(figsize=(8, 6), layout="constrained")
    margin = minsnap.certify(trajectory, corridor=found.boxes).corridor_margin
    ax = figure.add_subplot(
        xlabel="x [m]", ylabel="y [m]", title=f"{legs} boxes, {margin + RADIUS:.3f} m from any wall"
    )
    width, height = np.array(walls.shape) * PIXEL
    ax.imshow(~walls.T, origin="lower", extent=(0, width, 0, height), cmap="gray")
    for lower, upper in zip(found.boxes.lower, found.boxes.upper, strict=True):
        ax.add_patch(Rectangle(lower, *(upper - lower), facecolor="#56b4e9", edgecolor="#0072b2", alpha=0.25))
    position = trajectory.sample(rate=50).position
    ax.plot(position[:, 0], position[:, 1], color="#d55e00")
    save_figure(figure, folder / "maze.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))
