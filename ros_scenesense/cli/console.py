"""Where commands print."""

from __future__ import annotations

from typing import Any

from rich.console import Console


def console_of(width: int, **options: Any) -> Console:
    """The terminal; where there is none, such as in a file, lines of a width of their own.

    Args:
        width: Characters of these lines.
        options: Of `rich.console.Console`.
    """
    console = Console(**options)
    return console if console.is_terminal else Console(width=width, **options)


def plain_console() -> Console:
    """One for texts from outside: brackets are no markup in them, and what is long is not cut."""
    return console_of(200, highlight=False, markup=False, soft_wrap=True)
