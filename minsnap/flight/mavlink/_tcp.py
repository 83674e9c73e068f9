"""MAVLink over TCP, as client and as server."""

from __future__ import annotations

import errno
import socket
import time
from collections.abc import Sequence

from minsnap.errors import LinkError
from minsnap.flight.mavlink.link_transport import LinkTransport, Peer, port_error

_RETRY_AFTER = 0.5
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
        self._socket, self._pending = connection, b""

    def _drop(self) -> None:
        if self._socket is not None:
            self._socket.close()
        self._socket, self._pending = None, b""


class TcpClient(_Stream):
    """``tcp``: connects immediately or raises; after a loss it reconnects twice per second without blocking."""

    def __init__(self, host: str, port: int, timeout: float = 3.0) -> None:
        super().__init__(f"tcp:{host}:{port}")
        self._destination = (host, port)
        self._underway: socket.socket | None = None
        self._next_try = 0.0
        try:
            self._adopt(socket.create_connection(self._destination, timeout))
        except OSError as error:
            reason = error.strerror or str(error)
            raise LinkError(f"cannot connect to {self.address}: {reason}", address=self.address) from None

    def readers(self) -> Sequence[int]:
        return [self._socket.fileno()] if self._socket else []

    def close(self) -> None:
        super().close()
        self._give_up()

    def _open(self) -> bool:
        if self._underway is None and time.monotonic() >= self._next_try:
            self._next_try = time.monotonic() + _RETRY_AFTER
            self._underway = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            self._underway.setblocking(False)
        if self._underway is not None:
            self._continue(self._underway)
        return self._socket is not None

    def _continue(self, underway: socket.socket) -> None:
        """Check the state of a pending connection: established, pending or refused."""
        state = underway.connect_ex(self._destination)
        if state in _UNDERWAY:
            return
        self._underway = None
        if state in (0, errno.EISCONN):
            self._adopt(underway)
        else:
            underway.close()

    def _give_up(self) -> None:
        if self._underway is not None:
            self._underway.close()
            self._underway = None


class TcpListener(_Stream):
    """``tcpin``: accepts one connection at a time."""

    def __init__(self, host: str, port: int) -> None:
        super().__init__(f"tcpin:{host}:{port}")
        self._listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._listener.bind((host, port))
            self._listener.listen(1)
        except OSError as error:
            self._listener.close()
            raise port_error(self.address, error) from None
        self._listener.setblocking(False)

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
