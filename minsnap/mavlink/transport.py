"""Sockets and serial ports that carry MAVLink: they never block, never print, and come back after a loss."""

from __future__ import annotations

import errno
import socket
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from minsnap.errors import LinkError

LOOPBACK = "127.0.0.1"
Peer = Any


class Transport(ABC):
    """Bytes to and from whoever is at the other end.

    Attributes
    ----------
    address : str
        What it was opened as, for messages.
    """

    address: str

    @abstractmethod
    def send(self, data: bytes) -> None:
        """Send one message, or drop it when the other end cannot take it now."""

    @abstractmethod
    def receive(self) -> tuple[bytes, Peer]:
        """Return what has arrived and from whom; empty when nothing has."""

    @abstractmethod
    def readers(self) -> Sequence[int]:
        """File descriptors that wake up when something arrives."""

    @abstractmethod
    def close(self) -> None:
        """Let go of the port."""

    def choose(self, peer: Peer) -> None:  # noqa: B027 - most transports have one peer from the start
        """From now on send to this peer alone, of those who may have spoken."""


def open_transport(connection: str, baud: int = 115200) -> Transport:
    """Open what a connection string names, in pymavlink's notation.

    ================================ ================================================================
    ``udpin:HOST:PORT``              listen for datagrams (``udp:`` and ``HOST:PORT`` mean the same)
    ``udpout:HOST:PORT``             send datagrams there, and listen for what comes back
    ``tcp:HOST:PORT``                connect
    ``tcpin:HOST:PORT``              wait for a connection
    ``serial:DEVICE[:BAUD]``         serial port (a bare ``/dev/...`` or ``COM1`` too, with ``,BAUD``)
    ================================ ================================================================

    Without a host (``udpin:14550``, ``udpin::14550``) it is the loopback address: nothing is opened to a network unless
    an address of it, or 0.0.0.0, is given.

    Parameters
    ----------
    connection : str
        As above.
    baud : int
        Of a serial port, unless the string has one.

    Raises
    ------
    LinkError
        If the string cannot be understood, or the port cannot be opened.
    ImportError
        If a serial port is asked for and pyserial is not installed.
    """
    from minsnap.mavlink import _serial, _tcp, _udp

    kind, _, rest = connection.partition(":")
    if kind == "serial" or "/" in kind or kind.upper().startswith("COM"):
        return _serial.open_port(rest if kind == "serial" else connection, baud)
    kinds = {"udpin": _udp.UdpListener, "udp": _udp.UdpListener, "udpout": _udp.UdpSender}
    opener = (kinds | {"tcp": _tcp.TcpClient, "tcpin": _tcp.TcpListener}).get(kind)
    host, port = _host_and_port(connection if opener is None else rest, connection)
    return (opener or _udp.UdpListener)(host, port)


def _host_and_port(text: str, connection: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not (port.isdecimal() and int(port) < 65536) or ":" in host:
        raise LinkError(
            f"cannot understand the connection {connection!r}: give udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, "
            "tcpin:HOST:PORT or serial:DEVICE:BAUD",
            address=connection,
        )
    return host or LOOPBACK, int(port)


def port_error(address: str, error: OSError) -> LinkError:
    """Return the error for a port that cannot be opened, in one sentence."""
    if error.errno == errno.EADDRINUSE:
        return LinkError(f"cannot listen on {address}: another program uses that port", address=address)
    return LinkError(f"cannot open {address}: {error.strerror or error}", address=address)


def resolve(host: str, address: str) -> str:
    """Return the numeric address of a host, or raise LinkError."""
    try:
        return socket.gethostbyname(host)
    except OSError:
        raise LinkError(f"cannot open {address}: no host is called {host!r}", address=address) from None
