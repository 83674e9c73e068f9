"""Heights from GeoTIFFs: those that Pillow's libtiff writes, one of big-endian tiles by hand, and what is refused."""

import struct

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin, features

from minsnap.errors import FileError
from minsnap.paths.routes import read_terrain

HEIGHTS = np.round(100.0 * np.sin(np.arange(35 * 23).reshape(35, 23) ** 1.3), 2).astype(np.float32)
SCALE, TIE = (10.0, 10.0, 0.0), (0.0, 0.0, 0.0, 500000.0, 5400000.0, 0.0)
UTM = (1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3072, 0, 1, 32632)
PACKED = pytest.param("tiff_lzw"), pytest.param("tiff_adobe_deflate"), pytest.param("raw")


def write(path, heights=HEIGHTS, scale=SCALE, tie=TIE, keys=UTM, nodata=None, compression="raw", **tags):
    info = TiffImagePlugin.ImageFileDirectory_v2()
    for tag, kind, value in ((33550, 12, scale), (33922, 12, tie), (34735, 3, keys), *tags.get("more", ())):
        if value is not None:
            info[tag], info.tagtype[tag] = value, kind
    if nodata is not None:
        info[42113], info.tagtype[42113] = nodata, 2
    if "predictor" in tags:
        info[317] = tags["predictor"]
    Image.fromarray(heights).save(path, tiffinfo=info, compression=compression)
    return path


@pytest.mark.parametrize("compression", PACKED)
@pytest.mark.parametrize("kind", [np.float32, np.int32, np.uint16])
def test_heights_lie_where_the_tie_point_and_the_pixels_say(tmp_path, compression, kind):
    if compression != "raw" and not features.check("libtiff"):
        pytest.skip("Pillow was built without libtiff")
    given = (HEIGHTS + 200.0).astype(kind)
    found = read_terrain(write(tmp_path / "dem.tif", given, compression=compression))
    assert found.side == 10.0 and found.heights.shape == (23, 35)
    np.testing.assert_array_equal(found.heights, given[::-1].T)
    assert found.middle == pytest.approx([500005.0, 5400000.0 - 345.0])
    assert found.reach[1] == pytest.approx([500225.0, 5399995.0])


def test_heights_of_points_and_a_tie_point_inside_are_counted_from(tmp_path):
    points = tuple(2 if index == 11 else value for index, value in enumerate(UTM))
    found = read_terrain(write(tmp_path / "dem.tiff", tie=(2.0, 3.0, 0.0, 70.0, 40.0, 0.0), keys=points))
    assert found.middle == pytest.approx([50.0, 70.0 - 340.0])


def test_what_is_not_known_is_no_number(tmp_path):
    heights = HEIGHTS.copy()
    heights[3, 4], heights[5, 6] = -32768.0, np.inf
    found = read_terrain(write(tmp_path / "dem.tif", heights, nodata="-32768"))
    assert np.isnan(found.heights[4, -4]) and np.isnan(found.heights[6, -6]) and np.isnan(found.heights).sum() == 2


def test_tiles_of_the_other_byte_order_are_put_together(tmp_path):
    """40 x 20 heights of 16 bits in tiles of 16 x 16, big-endian, written here byte by byte."""
    heights = np.arange(40 * 20, dtype=">i2").reshape(40, 20) - 300
    padded = np.zeros((48, 32), dtype=">i2")
    padded[:40, :20] = heights
    tiles = [padded[y : y + 16, x : x + 16].tobytes() for y in (0, 16, 32) for x in (0, 16)]
    tags = [(256, 3, [20]), (257, 3, [40]), (258, 3, [16]), (259, 3, [1]), (262, 3, [1]), (277, 3, [1])]
    tags += [(322, 3, [16]), (323, 3, [16]), (324, 4, [0] * 6), (325, 4, [512] * 6), (339, 3, [2])]
    tags += [(33550, 12, SCALE), (33922, 12, TIE), (34735, 3, UTM)]
    kinds, start = {3: "H", 4: "I", 12: "d"}, 8 + 2 + 12 * len(tags) + 4
    sizes = [len(values) * struct.calcsize(kinds[kind]) for _, kind, values in tags]
    ends = np.cumsum([size if size > 4 else 0 for size in sizes])
    offsets = [start + int(ends[-1]) + 512 * index for index in range(6)]
    entries, behind = b"", b""
    for (tag, kind, values), size in zip(tags, sizes, strict=True):
        values = offsets if tag == 324 else values
        packed = struct.pack(f">{len(values)}{kinds[kind]}", *values)
        place = struct.pack(">I", start + len(behind)) if size > 4 else packed.ljust(4, b"\0")
        entries += struct.pack(">HHI", tag, kind, len(values)) + place
        behind += packed if size > 4 else b""
    head = b"MM\0*" + struct.pack(">IH", 8, len(tags))
    (tmp_path / "dem.tif").write_bytes(head + entries + b"\0" * 4 + behind + b"".join(tiles))
    np.testing.assert_array_equal(read_terrain(tmp_path / "dem.tif").heights, heights[::-1].T)


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"keys": tuple(2 if index == 7 else value for index, value in enumerate(UTM))}, "in degrees of latitude"),
        ({"keys": (1, 1, 0, 1, 3076, 0, 1, 9002)}, r"coordinates in another unit than the metre \(EPSG 9002\)"),
        ({"keys": (1, 1, 0, 1, 4099, 0, 1, 9003)}, "heights in another unit than the metre"),
        ({"tie": None}, "does not say where it lies"),
        ({"scale": None}, "is turned, or bound to several points"),
        ({"scale": (10.0, 20.0, 0.0)}, "cells of 10 by 20 m"),
        ({"scale": (0.0, 0.0, 0.0)}, "size of a pixel"),
        ({"tie": (0.0, 0.0, 0.0, np.nan, 0.0, 0.0)}, "finite numbers"),
        ({"heights": np.zeros((4, 4, 3), dtype=np.uint8)}, "picture in colours"),
        ({"heights": np.zeros((1, 4), dtype=np.float32)}, "1 x 4 heights"),
        ({"nodata": "none"}, "is not a GeoTIFF"),
    ],
)
def test_what_gives_no_heights_in_metres_is_refused_in_a_sentence(tmp_path, how, words):
    with pytest.raises(FileError, match=words):
        read_terrain(write(tmp_path / "dem.tif", **how))


def test_damaged_files_are_refused(tmp_path):
    whole = write(tmp_path / "whole.tif").read_bytes()
    for length in (0, 4, 8, 60, len(whole) // 2):
        (tmp_path / "dem.tif").write_bytes(whole[:length])
        with pytest.raises(FileError, match=r"dem\.tif"):
            read_terrain(tmp_path / "dem.tif")
