"""Draw the pictures of the documentation again: run every example, and keep its figure with a small palette.

``make figures`` runs this; ``docs/images`` holds the result.
"""

import runpy
import sys
import tempfile
from pathlib import Path

import matplotlib
from PIL import Image

ROOT = Path(__file__).parents[1]
COLOURS = 128
SLOW = {"race": ["3"]}
"""More arguments of examples: the race with three polynomials a leg, as the page on racing says."""


def draw(script: Path, folder: Path) -> None:
    """Run an example in a folder of its own and copy its figure, if it has one."""
    matplotlib.use("agg")
    sys.argv = [str(script), str(folder), *SLOW.get(script.stem, [])]
    runpy.run_path(str(script), run_name="__main__")
    figure = folder / f"{script.stem}.png"
    if figure.exists():
        target = ROOT / "docs" / "images" / figure.name
        Image.open(figure).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(target, optimize=True)
        print(f"{target.name}: {target.stat().st_size // 1024} KB")


def main(names: list[str]) -> None:
    """Draw the figures of the examples named, or of all."""
    for script in sorted((ROOT / "examples").glob("*.py")):
        if not names or script.stem in names:
            with tempfile.TemporaryDirectory() as folder:
                draw(script, Path(folder))


if __name__ == "__main__":
    main(sys.argv[1:])
