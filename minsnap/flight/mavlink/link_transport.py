"""Sockets and serial ports for MAVLink: non-blocking, without output, and reconnecting after a loss."""

from __future__ import annotations

import errno
import socket
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

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
