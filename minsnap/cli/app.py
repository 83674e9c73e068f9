"""The command-line application: registration of commands and what their failures look like."""

from __future__ import annotations

import sys

import typer

from minsnap.errors import MinsnapError

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)


def main() -> None:
    """Run the command line; errors are one plain sentence on stderr and an exit status of 1 or 2."""
    try:
        app()
    except MinsnapError as error:
        fail(str(error), error.exit_status)
    except OSError as error:
        fail(f"{error.filename}: {error.strerror}" if error.filename else str(error), 2)
    except ImportError as error:
        fail(str(error), 2)


def fail(message: str, status: int) -> None:
    """Say ``message`` on stderr and leave with ``status``."""
    print(f"minsnap: {message}", file=sys.stderr)
    sys.exit(status)
