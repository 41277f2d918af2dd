"""Texts that people write, as files: read with a clear word about what is wrong with them."""

from __future__ import annotations

from pathlib import Path

from ros_scenesense.errors import LanguageError

LONGEST_TEXT = 4 * 2**20
"""Longer texts are refused; in characters."""


def check_length(text: str, source: str) -> None:
    """Checks that a text is not too long to be one that a person wrote.

    Raises:
        LanguageError: If it is.
    """
    if len(text) > LONGEST_TEXT:
        raise LanguageError(f"{source} has {len(text)} characters, expected at most {LONGEST_TEXT}")


def read_text(path: Path) -> str:
    """The text of a file.

    Raises:
        LanguageError: If it cannot be read or is no UTF-8 text; with the place of the first byte
            that is none.
    """
    try:
        return path.read_bytes().decode("utf-8")
    except OSError as error:
        raise LanguageError(f"{path} cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        column = error.start - error.object.rfind(b"\n", 0, error.start)
        raise LanguageError(
            f"{path}:{line}:{column}: found the byte 0x{error.object[error.start]:02X}, expected "
            "text in UTF-8"
        ) from error
