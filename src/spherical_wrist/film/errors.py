"""Errors of films."""

from spherical_wrist.errors import WristError


class FilmError(WristError):
    """A film or picture cannot be rendered or written on this machine."""
