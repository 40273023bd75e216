"""The errors a user can meet. Each is one clear line; the command line adds no traceback."""

from __future__ import annotations

__all__ = ["AvneoError", "SceneError", "SolveError"]

#: Values are cut after so many characters: a whole table would bury the message.
_LONGEST_VALUE = 120


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
        text = repr(value)
        if len(text) > _LONGEST_VALUE:
            text = f"{text[:_LONGEST_VALUE]}..."
        super().__init__(f"{key} = {text}: {valid}")

    def __reduce__(self) -> tuple[type[SceneError], tuple[str, object, str]]:
        """Rebuild from the three parts: so that the error can travel between processes."""
        return type(self), (self.key, self.value, self.valid)


class SolveError(AvneoError):
    """A stage failed; the last accepted state was kept (exit status 1)."""
