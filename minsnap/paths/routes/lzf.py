"""Decompression of LZF, the form of blocks in compressed PCD files (M. Lehmann, liblzf)."""

from __future__ import annotations


def decompress(block: bytes, size: int) -> bytes:
    """Return the content of an LZF block.

    A control byte below 32 is followed by that many bytes and one more as they are; another one holds, in its upper 3
    bits, the length of a repetition less 2 (7: a byte to add follows) and, in its lower 5 and the next byte, its
    distance back less 1.

    Parameters
    ----------
    block : bytes
    size : int
        Bytes of the content.

    Raises
    ------
    ValueError
        If the block is damaged.
    """
    output, at = bytearray(), 0
    while at < len(block) and len(output) <= size:
        control = block[at]
        at += 1
        if control < 32:
            output += block[at : at + control + 1]
            at += control + 1
            continue
        length = control >> 5
        if length == 7:
            length += block[at]
            at += 1
        back = ((control & 31) << 8) + block[at] + 1
        at += 1
        _repeat(output, back, length + 2)
    if len(output) != size:
        raise ValueError("a block of another size than it should have")
    return bytes(output)


def _repeat(output: bytearray, back: int, length: int) -> None:
    """Append bytes from some way back; the repetition may run into itself."""
    start = len(output) - back
    if start < 0:
        raise ValueError("a reference to data before the block")
    piece = bytes(output[start : start + length])
    output += (piece * (length // len(piece) + 1))[:length]
