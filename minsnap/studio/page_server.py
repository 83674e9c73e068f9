"""The server of the page: viser on one address, for pages that it served itself."""

from __future__ import annotations

import contextlib
import io
import socket
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from minsnap.errors import LinkError

if TYPE_CHECKING:
    import viser

LOOPBACK = "127.0.0.1"
"""The address that is listened on unless told otherwise."""

PORT = 8080
"""The port unless told otherwise."""


def start_server(host: str = LOOPBACK, port: int = PORT) -> viser.ViserServer:
    """Start the server of a page.

    Only pages from this server may connect (by the ``Origin`` that a browser sends), so that no other page that the
    browser shows can edit the scene; and no tunnel to a public address can be opened.

    Parameters
    ----------
    host : str
        Address to listen on.
    port : int
        0 for any that is free.

    Raises
    ------
    LinkError
        If it cannot listen there.
    ImportError
        If viser is not there.
    """
    try:
        import viser
    except ImportError as error:
        raise ImportError("the studio needs viser: pip install minsnap[studio]") from error
    check_free(host, port)
    with contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, verbose=False)
    if port and server.get_port() != port:
        stop_server(server)
        raise _taken(host, port)
    server.request_share_url = lambda verbose=True: None  # type: ignore[method-assign]
    _refuse_other_pages(server, host)
    return server


def stop_server(server: viser.ViserServer) -> None:
    """Stop a server, without its message."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def fold(client: Any, panel: Any) -> None:
    """Fold a panel in one browser; viser folds only panels of one browser there, or in all."""
    handle = client.gui.main_panel
    handle._placement_uuid = panel._placement_uuid
    handle.minimize()


def check_free(host: str, port: int) -> None:
    """Raise LinkError unless this address can be listened on; viser would take the next port silently."""
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except OverflowError:
        raise LinkError(f"there is no port {port}: choose one from 1 to 65535", address=f"{host}:{port}") from None
    except OSError as error:
        raise _taken(host, port) from error


def is_own_page(origin: str | None, named: str | None, host: str) -> bool:
    """Whether a connection comes from a page of this server, or from a program.

    Parameters
    ----------
    origin, named : str or None
        Headers ``Origin`` and ``Host`` of the request; programs send no origin.
    host : str
        Address that is listened on.
    """
    if origin is None:
        return True
    if named is None or urlsplit(origin).netloc != named:
        return False
    name = urlsplit(f"//{named}").hostname
    return host not in (LOOPBACK, "localhost", "::1") or name in (LOOPBACK, "localhost", "::1")


def _refuse_other_pages(server: viser.ViserServer, host: str) -> None:
    sockets: Any = server._websock_server

    async def check(client: Any) -> None:
        connection = sockets._live_connections[client.client_id]
        headers = connection.request.headers
        if not is_own_page(headers.get("Origin"), headers.get("Host"), host):
            await connection.close(1008, "this page does not belong to the studio")

    sockets._client_connect_cb.insert(0, check)


def _taken(host: str, port: int) -> LinkError:
    return LinkError(
        f"port {port} of {host} cannot be listened on: another program uses it, or it is not allowed; "
        "choose another with --port",
        address=f"{host}:{port}",
    )
