"""One packet for all Crazyflies of a radio channel, through the Crazyradio that cflib's links share.

Every Crazyflie listens to the address 0xFFE7E7E7E7 beside its own, and acknowledges nothing that comes there (esb.c of
crazyflie2-nrf-firmware). The dongle therefore sends such a packet as often as it retries one that is not acknowledged,
four times as cflib sets it. Its retries stay on: without them cflib waits a second for an answer of the dongle.
"""

from __future__ import annotations

import os
from typing import Any

ADDRESS = (0xFF, 0xE7, 0xE7, 0xE7, 0xE7)


def channel_of(uri: str) -> str | None:
    """Return dongle, channel and data rate of an address, ``radio://0/80/2M``; None where there is no broadcast."""
    if not uri.startswith("radio://") or os.environ.get("USE_CFLINK") == "cpp":
        return None
    dongle, *parts = uri.partition("?")[0].removeprefix("radio://").strip("/").split("/")
    channel, rate = (*parts[:2], *("2", "2M")[len(parts[:2]) :])
    return f"radio://{dongle}/{channel}/{rate}"


class RadioBroadcast:
    """The vehicles of a dongle, a channel and a data rate.

    Parameters
    ----------
    channel : str
        From :func:`channel_of`, of links that are open.
    """

    def __init__(self, channel: str) -> None:
        from cflib.crtp.radiodriver import RadioDriver, RadioManager

        dongle, number, rate, *_ = RadioDriver.parse_uri(channel)
        self.name = channel
        self._radio: Any = RadioManager.open(dongle)
        self._radio.set_channel(number)
        self._radio.set_data_rate(rate)
        self._radio.set_address(ADDRESS)

    def send(self, packet: bytes) -> None:
        """Send a packet, and return when the dongle has."""
        self._radio.send_packet(packet)

    def close(self) -> None:
        """Give the radio back to the links."""
        self._radio.close()
