"""MAVLink over UDP, listening on a port or sending to an address."""

from __future__ import annotations

import socket
from collections.abc import Sequence

from minsnap.flight.mavlink.link_transport import LOOPBACK, LinkTransport, Peer, port_error, resolve


class UdpListener(LinkTransport):
    """``udpin``: bound to a port; sends to all known peers until the vehicle is chosen, then to the vehicle only."""

    def __init__(self, host: str, port: int) -> None:
        self.address = f"udpin:{host}:{port}"
        self._socket = bind_udp(host, port, self.address)
        self._peers: set[Peer] = set()
        self._chosen = False

    def send(self, data: bytes) -> None:
        for peer in self._peers:
            _send_datagram(self._socket, data, peer)

    def receive(self) -> tuple[bytes, Peer]:
        data, peer = _receive_datagram(self._socket)
        if data and not self._chosen:
            self._peers.add(peer)
        return data, peer

    def readers(self) -> Sequence[int]:
        return [self._socket.fileno()]

    def outlet(self) -> tuple[int, Peer | None] | None:
        return (self._socket.fileno(), next(iter(self._peers))) if len(self._peers) == 1 else None

    def choose(self, peer: Peer) -> None:
        self._chosen = True
        self._peers = {peer}

    def close(self) -> None:
        self._socket.close()


class UdpSender(LinkTransport):
    """``udpout``: sends to one address from a port of its own, and listens there."""

    def __init__(self, host: str, port: int) -> None:
        self.address = f"udpout:{host}:{port}"
        self._destination = (resolve(host, self.address), port)
        own = LOOPBACK if self._destination[0].startswith("127.") else "0.0.0.0"
        self._socket = bind_udp(own, 0, self.address)

    def outlet(self) -> tuple[int, Peer | None] | None:
        return self._socket.fileno(), self._destination

    def send(self, data: bytes) -> None:
        _send_datagram(self._socket, data, self._destination)

    def receive(self) -> tuple[bytes, Peer]:
        return _receive_datagram(self._socket)

    def readers(self) -> Sequence[int]:
        return [self._socket.fileno()]

    def close(self) -> None:
        self._socket.close()


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


def _send_datagram(sender: socket.socket, data: bytes, peer: Peer) -> None:
    try:
        sender.sendto(data, peer)
    except OSError:  # no receiver or no route at present: the link detects it by its timeout
        return


def _receive_datagram(receiver: socket.socket) -> tuple[bytes, Peer]:
    try:
        return receiver.recvfrom(65535)
    except OSError:  # no data, or an ICMP error for an earlier datagram
        return b"", None
