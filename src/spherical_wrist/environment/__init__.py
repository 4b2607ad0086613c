"""Gymnasium environments on the compiled loop: an agent takes the place of a control law.

Importing this module registers them::

    import gymnasium
    import spherical_wrist.environment

    env = gymnasium.make("spherical_wrist/Track-v0")
    envs = gymnasium.make_vec("spherical_wrist/Track-v0", num_envs=64)

``gymnasium.make("spherical_wrist.environment:spherical_wrist/Track-v0")`` registers them too. See
:mod:`spherical_wrist.environment.observation`, :mod:`spherical_wrist.environment.action` and
:mod:`spherical_wrist.environment.reward` for observations, actions and rewards, and
:class:`spherical_wrist.environment.track.TrackEnv` and
:class:`spherical_wrist.environment.track_vector.TrackVectorEnv` for the arguments.
"""

from spherical_wrist.missing_package import missing

TRACK = "spherical_wrist/Track-v0"
"""Id of the environment in which the wrist follows a reference, with any part of an experiment."""


def register() -> None:
    """Register the environments with Gymnasium, if they are not registered yet.

    Raises:
        ParameterError: Gymnasium is not installed.
    """
    try:
        from gymnasium.envs import registration
    except ImportError:
        raise missing("environments need Gymnasium", "gym") from None
    if TRACK not in registration.registry:
        registration.register(
            TRACK,
            entry_point="spherical_wrist.environment.track:TrackEnv",
            vector_entry_point="spherical_wrist.environment.track_vector:TrackVectorEnv",
        )


register()
