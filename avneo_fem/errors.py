"""The errors a user can meet. Each is one clear line; the command line adds no traceback."""

from __future__ import annotations

__all__ = ["AvneoError", "SceneError", "SolveError"]


class AvneoError(Exception):
    """Base of all errors that are reported to the user as one line."""

    exit_status = 1


class SceneError(AvneoError):
    """The scene cannot be run as written (exit status 2).

    Parameters
    ----------
    key : str
        Dotted name of the offending scene entry, e.g. ``template.belly_radius``.
    value : object
        What the scene says.
    valid : str
        What would be valid, in words a user can act on.
    """

    exit_status = 2

    def __init__(self, key: str, value: object, valid: str) -> None:
        self.key, self.value, self.valid = key, value, valid
        super().__init__(f"{key} = {value!r}: {valid}")


class SolveError(AvneoError):
    """A stage failed; the last accepted state was kept (exit status 1)."""
