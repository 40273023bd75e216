"""Files that appear whole or not at all (design.md §2)."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["written_whole"]


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """Temporary file in the folder of ``path`` that takes its place when the block succeeds.

    Parameters
    ----------
    path : str or Path
        Final name. Its folder must exist.

    Yields
    ------
    Path
        Name to write to, with the same suffix (some writers choose the format by it). It is
        synchronised to disk and renamed at the end, and removed if the block raises.

    Raises
    ------
    OSError
        When the folder cannot be written to.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}-{os.getpid()}-{secrets.token_hex(4)}{path.suffix}")
    temporary.open("xb").close()
    try:
        yield temporary
        with temporary.open("rb") as stream:
            os.fsync(stream.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
