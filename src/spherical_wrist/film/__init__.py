"""Films of runs, rendered by MuJoCo without a screen."""

from spherical_wrist.film.errors import FilmError
from spherical_wrist.film.film import Film, render_film, render_picture
from spherical_wrist.film.shot import Shot

__all__ = ["Film", "FilmError", "Shot", "render_film", "render_picture"]
