"""Sockets and serial ports for MAVLink, opened by a connection string, non-blocking; TCP is connected again if lost."""

from __future__ import annotations

import errno
import re
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from minsnap.basics.checks import check_kind
from minsnap.basics.optional_packages import optional
from minsnap.errors import LinkError

LOOPBACK = "127.0.0.1"
Peer = Any


class LinkTransport(ABC):
    """A channel for bytes to and from the peers at the other end.

    Attributes
    ----------
    address : str
        What it was opened as, for messages.
    """

    address: str

    @abstractmethod
    def send(self, data: bytes) -> None:
        """Send one message, or drop it if the channel cannot accept it now."""

    @abstractmethod
    def receive(self) -> tuple[bytes, Peer]:
        """Return the received bytes and their sender; empty if nothing was received."""

    @abstractmethod
    def readers(self) -> Sequence[int]:
        """File descriptors that become readable on arrival of data."""

    @abstractmethod
    def close(self) -> None:
        """Close the port."""

    def outlet(self) -> tuple[int, Peer | None] | None:
        """Return the file descriptor to which another thread may write messages, and where datagrams go from it.

        None where there is no such channel: a connection that may be made anew, several peers, or none yet.
        """
        return None

    def choose(self, peer: Peer) -> None:  # noqa: B027 - most transports have one peer from the start
        """Send only to this peer from now on."""


def port_error(address: str, error: OSError) -> LinkError:
    """Return the error for a port that cannot be opened."""
    if error.errno == errno.EADDRINUSE:
        return LinkError(f"cannot listen on {address}: another program uses that port", address=address)
    return LinkError(f"cannot open {address}: {error.strerror or error}", address=address)


def resolve(host: str, address: str) -> str:
    """Return the numeric address of a host, or raise LinkError."""
    try:
        return socket.gethostbyname(host)
    except OSError:
        raise LinkError(f"cannot open {address}: no host is called {host!r}", address=address) from None


class SerialPort(LinkTransport):
    """``serial``: a device and its baud rate, through pyserial."""

    def __init__(self, device: str, baud: int) -> None:
        self.address = f"serial:{device}:{baud}"
        if baud < 1:  # which would hang up the line
            raise LinkError(f"cannot open {self.address}: give a baud rate, such as 57600", address=self.address)
        serial = optional("serial", "serial ports need pyserial", "mavlink")
        try:
            self._port = serial.Serial(device, baud, timeout=0, write_timeout=0)
        except (OSError, ValueError) as error:
            raise LinkError(f"cannot open {self.address}: {error}", address=self.address) from None
        self._gone = False

    def send(self, data: bytes) -> None:
        with suppress(OSError):  # pyserial's errors among them
            self._port.write(data)

    def receive(self) -> tuple[bytes, Peer]:
        data, self._gone = b"", True
        with suppress(OSError):
            data, self._gone = self._port.read(4096), False
        return data, self.address

    def readers(self) -> Sequence[int]:
        return [] if self._gone else [self._port.fileno()]  # an unplugged port is always readable

    def outlet(self) -> tuple[int, Peer | None] | None:
        return self._port.fileno(), None

    def close(self) -> None:
        self._port.close()


_PATIENCE, _RETRY_AFTER = 3.0, 0.5
_UNDERWAY = (errno.EINPROGRESS, errno.EALREADY)


class _Stream(LinkTransport):
    """Common part of client and server: a connection that may be lost, and the unsent rest of a message."""

    def __init__(self, address: str) -> None:
        self.address = address
        self._socket: socket.socket | None = None
        self._pending = b""

    def send(self, data: bytes) -> None:
        if self._socket is None:
            return
        whole = self._pending or data  # the rest of a message goes first; meanwhile new ones are dropped
        try:
            self._pending = whole[self._socket.send(whole) :]
        except BlockingIOError:
            self._pending = whole if self._pending else b""
        except OSError:
            self._drop()

    def receive(self) -> tuple[bytes, Peer]:
        if self._socket is None and not self._open():
            return b"", None
        try:
            data = self._socket.recv(65536) if self._socket else b""
        except BlockingIOError:
            return b"", None
        except OSError:
            data = b""
        if not data:
            self._drop()
        return data, self.address

    def close(self) -> None:
        self._drop()

    def _open(self) -> bool:
        """Connect if necessary; return whether a connection exists."""
        raise NotImplementedError

    def _adopt(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._drop()
        self._socket = connection

    def _drop(self) -> None:
        if self._socket is not None:
            self._socket.close()
        self._socket, self._pending = None, b""


class TcpClient(_Stream):
    """``tcp``: connects immediately or raises; after a loss it reconnects twice per second without blocking."""

    def __init__(self, host: str, port: int) -> None:
        super().__init__(f"tcp:{host}:{port}")
        self._destination = (resolve(host, self.address), port)
        self._underway: socket.socket | None = None
        self._next_try = 0.0
        try:
            self._adopt(socket.create_connection(self._destination, _PATIENCE))
        except OSError as error:
            reason = error.strerror or str(error)
            raise LinkError(f"cannot connect to {self.address}: {reason}", address=self.address) from None

    def readers(self) -> Sequence[int]:
        return [self._socket.fileno()] if self._socket else []

    def close(self) -> None:
        super().close()
        if self._underway is not None:
            self._underway.close()
            self._underway = None

    def _open(self) -> bool:
        if self._underway is None and time.monotonic() >= self._next_try:
            self._next_try = time.monotonic() + _RETRY_AFTER
            self._underway = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            self._underway.setblocking(False)
        pending = self._underway
        state = errno.EALREADY if pending is None else pending.connect_ex(self._destination)
        if pending is not None and state not in _UNDERWAY:
            self._underway = None
            if state in (0, errno.EISCONN):
                self._adopt(pending)
            else:
                pending.close()
        return self._socket is not None


class TcpListener(_Stream):
    """``tcpin``: accepts one connection at a time; a newer one takes the place of one that has fallen silent."""

    def __init__(self, host: str, port: int) -> None:
        super().__init__(f"tcpin:{host}:{port}")
        self._heard = 0.0
        self._listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._listener.bind((host, port))
            self._listener.listen(1)
        except OSError as error:
            self._listener.close()
            raise port_error(self.address, error) from None
        self._listener.setblocking(False)

    def receive(self) -> tuple[bytes, Peer]:
        data, peer = super().receive()
        now = time.monotonic()
        if data:
            self._heard = now
        elif now - self._heard > _PATIENCE:
            self._open()
        return data, peer

    def readers(self) -> Sequence[int]:
        return [(self._socket or self._listener).fileno()]

    def close(self) -> None:
        super().close()
        self._listener.close()

    def _open(self) -> bool:
        try:
            connection, _ = self._listener.accept()
        except OSError:
            return False
        self._adopt(connection)
        return True


class Udp(LinkTransport):
    """Datagrams to one address, or to all that are heard until the vehicle is chosen, then to the vehicle only."""

    def __init__(self, address: str, bound: socket.socket, *peers: Peer) -> None:
        self.address, self._socket, self._peers = address, bound, set(peers)
        self._listens = self._gathers = not peers

    def send(self, data: bytes) -> None:
        for peer in self._peers:
            with suppress(OSError):  # no receiver or no route at present: the link detects it by its timeout
                self._socket.sendto(data, peer)

    def receive(self) -> tuple[bytes, Peer]:
        try:
            data, peer = self._socket.recvfrom(65535)
        except OSError:  # no data, or an ICMP error for an earlier datagram
            return b"", None
        if data and self._gathers:
            self._peers.add(peer)
        return data, peer

    def choose(self, peer: Peer) -> None:
        if self._listens:
            self._gathers, self._peers = False, {peer}

    def readers(self) -> Sequence[int]:
        return [self._socket.fileno()]

    def outlet(self) -> tuple[int, Peer | None] | None:
        return (self._socket.fileno(), next(iter(self._peers))) if len(self._peers) == 1 else None

    def close(self) -> None:
        self._socket.close()


def listen_udp(host: str, port: int) -> Udp:
    """``udpin``: listen on a port."""
    address = f"udpin:{host}:{port}"
    return Udp(address, bind_udp(host, port, address))


def send_udp(host: str, port: int) -> Udp:
    """``udpout``: send to one address from a port of its own, and listen there."""
    address = f"udpout:{host}:{port}"
    there = resolve(host, address)
    own = LOOPBACK if there.startswith("127.") else "0.0.0.0"
    return Udp(address, bind_udp(own, 0, address), (there, port))


def bind_udp(host: str, port: int, address: str) -> socket.socket:
    """Bind a socket exclusively to its port."""
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        bound.bind((resolve(host, address), port))
    except OSError as error:
        bound.close()
        raise port_error(address, error) from None
    bound.setblocking(False)
    return bound


def open_transport(connection: str, baud: int = 115200) -> LinkTransport:
    """Open the transport that a connection string names, in pymavlink's notation.

    ================================ ================================================================
    ``udpin:HOST:PORT``              listen for datagrams (``udp:`` and ``HOST:PORT`` mean the same)
    ``udpout:HOST:PORT``             send datagrams there, and listen for what comes back
    ``tcp:HOST:PORT``                connect
    ``tcpin:HOST:PORT``              wait for a connection
    ``serial:DEVICE[:BAUD]``         serial port (a bare ``/dev/...`` or ``COM1`` too, with ``,BAUD``)
    ================================ ================================================================

    Without a host (``udpin:14550``, ``udpin::14550``) the loopback address is used: a port is open to a network only if
    an address of that network, or 0.0.0.0, is given.

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
        If a serial port is named and pyserial is not installed.
    """
    check_kind("connection", connection, str, "a connection string such as udpin:127.0.0.1:14550")
    kind, _, rest = connection.partition(":")
    if kind == "serial" or "/" in kind or kind.upper().startswith("COM"):
        device = rest if kind == "serial" else connection
        rated = re.fullmatch(r"(.*)[,:](\d+)", device)
        return SerialPort(rated[1], int(rated[2])) if rated else SerialPort(device, baud)
    kinds: dict[str, Callable[[str, int], LinkTransport]] = {"udpin": listen_udp, "udp": listen_udp, "udpout": send_udp}
    kinds |= {"tcp": TcpClient, "tcpin": TcpListener}
    host, port = _host_and_port(rest if kind in kinds else connection, connection)
    return kinds.get(kind, listen_udp)(host, port)


def _host_and_port(text: str, connection: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not (port.isdecimal() and int(port) < 65536) or ":" in host:
        raise LinkError(
            f"cannot understand the connection {connection!r}: give udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, "
            "tcpin:HOST:PORT or serial:DEVICE:BAUD",
            address=connection,
        )
    return host or LOOPBACK, int(port)
