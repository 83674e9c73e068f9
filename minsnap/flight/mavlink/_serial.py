"""MAVLink over a serial port."""

from __future__ import annotations

from collections.abc import Sequence

from minsnap.errors import LinkError
from minsnap.flight.mavlink.link_transport import LinkTransport, Peer


class SerialPort(LinkTransport):
    """``serial``: a device and its baud rate, through pyserial."""

    def __init__(self, device: str, baud: int) -> None:
        self.address = f"serial:{device}:{baud}"
        try:
            import serial
        except ImportError:
            raise ImportError("serial ports need pyserial: pip install minsnap[mavlink]") from None
        try:
            self._port = serial.Serial(device, baud, timeout=0, write_timeout=0)
        except (serial.SerialException, ValueError) as error:
            raise LinkError(f"cannot open {self.address}: {error}", address=self.address) from None
        self._failures: tuple[type[Exception], ...] = (serial.SerialException, OSError)

    def send(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except self._failures:
            return

    def receive(self) -> tuple[bytes, Peer]:
        try:
            return self._port.read(4096), self.address
        except self._failures:
            return b"", self.address

    def readers(self) -> Sequence[int]:
        return [self._port.fileno()]

    def outlet(self) -> tuple[int, Peer | None] | None:
        return self._port.fileno(), None

    def close(self) -> None:
        self._port.close()


def open_port(text: str, baud: int) -> SerialPort:
    """Open ``DEVICE``, ``DEVICE:BAUD`` or ``DEVICE,BAUD``."""
    for separator in (",", ":"):
        device, separated, rate = text.rpartition(separator)
        if separated and rate.isdecimal():
            return SerialPort(device, int(rate))
    return SerialPort(text, baud)
