"""Films of runs, rendered by MuJoCo without a screen."""

from spherical_wrist.film.errors import FilmError
from spherical_wrist.film.film import Film, render_film, render_picture
from spherical_wrist.film.settings import FilmSettings

__all__ = ["Film", "FilmError", "FilmSettings", "render_film", "render_picture"]
