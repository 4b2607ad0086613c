"""Gymnasium environments on the compiled loop: an agent sits where a control law sits.

Importing this module registers them::

    import gymnasium
    import spherical_wrist.environment

    env = gymnasium.make("spherical_wrist/Track-v0")
    envs = gymnasium.make_vec("spherical_wrist/Track-v0", num_envs=64)

and so does ``gymnasium.make("spherical_wrist.environment:spherical_wrist/Track-v0")``. What an agent sees is described
at :mod:`spherical_wrist.environment.observation`, what it does at :mod:`spherical_wrist.environment.action`, what it is
paid for at :mod:`spherical_wrist.environment.reward`, and the arguments at
:class:`spherical_wrist.environment.track.TrackEnv` and
:class:`spherical_wrist.environment.track_vector.TrackVectorEnv`.
"""

from spherical_wrist.errors import ParameterError

TRACK = "spherical_wrist/Track-v0"
"""Following a reference, under everything that an experiment can contain."""


def register() -> None:
    """Registers the environments with Gymnasium, where they are not registered yet.

    Raises:
        ParameterError: Gymnasium is not installed.
    """
    try:
        from gymnasium.envs import registration
    except ImportError:
        raise ParameterError("environments need Gymnasium: pip install 'spherical-wrist[gym]'") from None
    if TRACK not in registration.registry:
        registration.register(
            TRACK,
            entry_point="spherical_wrist.environment.track:TrackEnv",
            vector_entry_point="spherical_wrist.environment.track_vector:TrackVectorEnv",
        )


register()
