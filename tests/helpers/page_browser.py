"""Chromium for the tests of pages: the system's, headless, without a network."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

ARGUMENTS = (
    "--no-sandbox --disable-quic --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
).split()
"""WebGL is drawn by the processor."""

PATIENCE = 180_000
"""Longest wait for anything on a page: a busy machine draws a frame in seconds [ms]."""

SIZE = {"width": 1100, "height": 640}


@contextmanager
def chromium() -> Iterator[Any]:
    """Start the system's Chromium; skip the test where there is none, but not in continuous integration."""
    found = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if found is None and not os.environ.get("CI"):
        pytest.skip("there is no Chromium here")
    assert found is not None, "continuous integration needs Chromium: .ci/run installs it"
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=list(ARGUMENTS), headless=True)
        yield browser
        browser.close()


def open_page(browser: Any, url: str, **size: int) -> Any:
    """Open a page of a studio, and wait until it shows a scene and the certificate of its plan."""
    page = browser.new_page(viewport=SIZE | size)
    page.set_default_timeout(PATIENCE)
    page.foreign = []
    page.on("request", lambda request: page.foreign.append(request.url) if is_foreign(request.url, url) else None)
    page.goto(url)
    page.locator("canvas[data-engine]").wait_for()
    page.get_by_text("certified at every instant").wait_for()
    return page


def is_foreign(asked: str, url: str) -> bool:
    """Whether a request leaves the server of the page."""
    return not asked.startswith((url, url.replace("http", "ws"), "data:", "blob:"))


def on_screen(page: Any, camera: Any, point: Any) -> tuple[float, float]:
    """Return where a point of the scene is drawn: pixels of the page, by the pinhole camera that viser reports."""
    box = page.locator("canvas[data-engine]").bounding_box()
    w, x, y, z = camera.wxyz
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    seen = rotation.T @ (np.asarray(point) - camera.position)
    focal = 0.5 * box["height"] / np.tan(0.5 * camera.fov)
    return (
        box["x"] + 0.5 * box["width"] + focal * seen[0] / seen[2],
        box["y"] + 0.5 * box["height"] + focal * seen[1] / seen[2],
    )
