"""The README's example of learning: it is short, it runs, and what it learns holds on wrists it has not seen."""

EXAMPLE = """
import gymnasium
import numpy as np

import spherical_wrist.environment

options = {
    "experiment": {"law": "computed_torque_integral", "sensing": "realistic", "duration": 0.5},
    "randomize": {"mass_scale": (0.75, 1.25), "disturbance.level": (0.0, 0.3), "seed": (0, 9999)},
}
envs = gymnasium.make_vec("spherical_wrist/Track-v0", num_envs=32, action="gains", frame_skip=50, **options)


def rewards(gains, seed):  # the mean reward of each wrist under its gains, on a logarithmic scale
    envs.reset(seed=seed)
    return sum(envs.step(gains)[1] for _ in range(10)) / 10


random, mean, spread = np.random.default_rng(0), np.zeros(envs.single_action_space.shape), 0.5
for generation in range(8):  # the cross-entropy method
    tried = random.normal(mean, spread, (32, *mean.shape))
    best = tried[np.argsort(rewards(tried, seed=[generation] * 32))[-8:]]  # all of them on the same wrist
    mean, spread = best.mean(axis=0), best.std(axis=0) + 0.02

default, learnt = (rewards(np.tile(gains, (32, 1)), seed=1000).mean() for gains in (0.0 * mean, mean))
print(f"reward {default:.3f} with the default gains, {learnt:.3f} with {dict(zip(envs.action_names, 4**mean))} of them")
"""


def test_it_learns(capsys):
    assert len(EXAMPLE.strip().splitlines()) <= 25
    scope = {"__name__": "example"}
    exec(compile(EXAMPLE, "example", "exec"), scope)
    assert scope["learnt"] > scope["default"] + 0.05
    assert "with the default gains" in capsys.readouterr().out
