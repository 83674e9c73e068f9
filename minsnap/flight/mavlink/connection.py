"""Connection strings such as ``udpin:HOST:PORT``, and the transports that they name."""

from __future__ import annotations

from minsnap.errors import LinkError
from minsnap.flight.mavlink._serial import open_port
from minsnap.flight.mavlink._tcp import TcpClient, TcpListener
from minsnap.flight.mavlink._udp import UdpListener, UdpSender
from minsnap.flight.mavlink.link_transport import LOOPBACK, LinkTransport


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
    kind, _, rest = connection.partition(":")
    if kind == "serial" or "/" in kind or kind.upper().startswith("COM"):
        return open_port(rest if kind == "serial" else connection, baud)
    kinds = {"udpin": UdpListener, "udp": UdpListener, "udpout": UdpSender}
    opener = (kinds | {"tcp": TcpClient, "tcpin": TcpListener}).get(kind)
    host, port = _host_and_port(connection if opener is None else rest, connection)
    return (opener or UdpListener)(host, port)


def _host_and_port(text: str, connection: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not (port.isdecimal() and int(port) < 65536) or ":" in host:
        raise LinkError(
            f"cannot understand the connection {connection!r}: give udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT, "
            "tcpin:HOST:PORT or serial:DEVICE:BAUD",
            address=connection,
        )
    return host or LOOPBACK, int(port)
