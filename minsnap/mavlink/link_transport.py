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


class LinkTransport(ABC):
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
