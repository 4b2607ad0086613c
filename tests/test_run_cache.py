"""Cached models, laws and motions leave no trace in a run; plants perturbed in place are the compiled ones."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs import TOOL, Running, experiments, finished, mjcf, mounted, wrist_of
from sampling import count
from spherical_wrist import Experiment, simulate
from spherical_wrist.experiment.timing import Timing
from spherical_wrist.loop.engine import interpreted_engine
from spherical_wrist.measure.logged import channels_of
from spherical_wrist.measure.series import Series
from spherical_wrist.prepare.cache import LRU, Models, RunCache
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.prepare.plant import Perturbation, PlantModel, RigidParts, perturbed
from spherical_wrist.reference import Lissajous
from spherical_wrist.simulation.metric_accumulator import MetricAccumulator, compute_metrics
from spherical_wrist.simulation.rollouts import roll_out
from spherical_wrist.wrist import Wrist, WristFile

CENTRED = mjcf('<site name="tip" pos="0 0 -0.1"/>').replace('pos="0.001 0.002 0"', "")
CENTRED = CENTRED.replace('pos="0.002 -0.001 0.003"', "").replace('name="rotor" pos="0.01 0.02 0.3"', 'name="rotor"')
TOUCHING = TOOL.replace("<geom", '<geom contype="1" conaffinity="1"')
WRISTS = {
    "the package's": Wrist.load(),
    "without symmetry": wrist_of(mjcf()),
    "with its centre of mass in the joint": wrist_of(CENTRED),
    "with a mount": wrist_of(mounted(mjcf())),
    "with geometry that may touch": wrist_of(mjcf(TOUCHING)),
    "with a joint limit": wrist_of(mjcf(joint='range="0 1" limited="true" frictionloss="1e-3"')),
}
AXES = {"body_inertia", "body_iquat", "geom_sameframe", "site_sameframe"}
"""Principal axes have no order and no sign; what they stand for is compared as a tensor."""
UNUSED = {"cam_poscom0", "light_poscom0", "extent", "center", "meaninertia", "meanmass", "meansize"}

small = st.floats(-2e-3, 2e-3)
changes = st.builds(
    Perturbation,
    mass_scale=st.floats(0.3, 3.0),
    com_shift=st.tuples(small, small, small),
    payload=st.sampled_from([0.0, 0.02]),
    friction=st.sampled_from([0.0, 1e-3]),
    damping=st.sampled_from([0.0, 1e-3]),
)


def fields(struct):
    for name in dir(struct):
        value = getattr(struct, name) if not name.startswith("_") else None
        if isinstance(value, np.ndarray | int | float) and not isinstance(value, bool):
            yield name, np.asarray(value)


def tensor(model):
    body, axes = model.jnt_bodyid[0], np.empty(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[body])
    axes = axes.reshape(3, 3)
    return axes @ np.diag(model.body_inertia[body]) @ axes.T


@pytest.mark.parametrize("wrist", WRISTS.values(), ids=WRISTS)
@settings(max_examples=count(4, 15))
@given(change=changes, before=changes)
def test_a_plant_perturbed_in_place_is_the_compiled_one(wrist, change, before):
    plant = PlantModel(wrist, 5e-4)
    plant.perturb(before)
    plant.perturb(change)
    ours, theirs = plant.model, physics_model(perturbed(wrist, change), 5e-4)
    if theirs.ngeom > ours.ngeom:  # the payload is drawn where nothing visual can be left out
        return
    for mine, other in ((ours, theirs), (ours.opt, theirs.opt), (ours.stat, theirs.stat)):
        names = dict(fields(other))
        for name, value in fields(mine):
            if name not in AXES | UNUSED and value.dtype.kind in "if":
                np.testing.assert_allclose(value, names[name], rtol=1e-9, atol=1e-15, err_msg=name)
    made = mujoco.MjData(ours)
    for name in ("qpos", "qvel", "qacc_warmstart", "qfrc_applied", "ctrl", "time"):
        np.testing.assert_array_equal(getattr(plant.data, name), getattr(made, name))
    np.testing.assert_allclose(tensor(ours), tensor(theirs), rtol=1e-12, atol=1e-12 * tensor(theirs).max())


def states(model, data, count=50):
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.qvel[:] = [0.8, 0.2, -0.4, 0.4], [1.0, -2.0, 3.0]
    found = []
    for k in range(count):
        data.ctrl[:] = 0.01 * np.sin([k, 2 * k, 3 * k])
        mujoco.mj_step(model, data)
        found.append(np.concatenate([data.qpos, data.qvel]))
    return np.array(found)


@pytest.mark.parametrize("wrist", WRISTS.values(), ids=WRISTS)
def test_it_moves_as_the_compiled_one_and_leaves_no_trace(wrist):
    change = Perturbation(1.4, (1e-3, -2e-3, 5e-4), 0.0, 2e-3, 1e-4)
    plant, fresh = PlantModel(wrist, 1e-3), PlantModel(wrist, 1e-3)
    for each in (Perturbation(0.5, (1e-3, 0.0, 0.0), 0.03), Perturbation(friction=0.01), change):
        plant.perturb(each)
        moved = states(plant.model, plant.data)
    compiled = physics_model(perturbed(wrist, change), 1e-3)
    np.testing.assert_allclose(moved, states(compiled, mujoco.MjData(compiled)), rtol=1e-9, atol=1e-9)
    fresh.perturb(change)
    assert moved.tobytes() == states(fresh.model, fresh.data).tobytes()
    plant.perturb(Perturbation(0.7, payload=0.01))
    other = plant.copy()
    other.perturb(change)
    plant.perturb(Perturbation(friction=0.02))
    assert moved.tobytes() == states(other.model, other.data).tobytes()
    assert mujoco.MjData(other.model).qpos.tobytes() == mujoco.MjData(fresh.model).qpos.tobytes()


def test_the_whole_of_two_masses_is_the_reduced_mass_formula():
    """Two points m at ±a on x: J = 2 m a² across; a third at the tip moves the centre and adds m₁ m₂/(m₁ + m₂) d²."""
    zero = np.zeros((2, 3, 3))
    centres, rotations = np.array([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]]), np.array([np.eye(3), np.eye(3)])
    parts = RigidParts(np.array([0.5, 0.5]), centres, rotations, zero, np.array([0.0, 0.0, -0.2]))
    mass, centre, inertia = parts.perturbed(Perturbation(mass_scale=2.0, com_shift=(0.0, 0.3, 0.0))).merged()
    assert (mass, centre.tolist()) == (2.0, [0.0, 0.3, 0.0])
    np.testing.assert_allclose(inertia, np.diag([0.0, 0.02, 0.02]), atol=1e-15)
    mass, centre, inertia = parts.perturbed(Perturbation(payload=0.25)).merged()
    assert mass == 1.25
    np.testing.assert_allclose(centre, [0.0, 0.0, -0.04], atol=1e-15)
    reduced = 1.0 * 0.25 / 1.25 * 0.2**2
    np.testing.assert_allclose(inertia, np.diag([reduced, 0.01 + reduced, 0.01]), atol=1e-15)


def test_turned_parts_are_shifted_in_their_own_frames():
    quarter = np.array([[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    parts = RigidParts(np.ones(1), np.zeros((1, 3)), quarter, np.zeros((1, 3, 3)), np.zeros(3))
    _, centre, _ = parts.perturbed(Perturbation(com_shift=(0.1, 0.0, 0.0))).merged()
    np.testing.assert_allclose(centre, [0.0, 0.1, 0.0], atol=1e-15)


EXPERIMENTS = experiments()
ALONE = [simulate(experiment) for experiment in EXPERIMENTS]
CACHE = RunCache()


def run(experiment, cache, keep=lambda loop, logged: None):
    [result] = roll_out([lambda: experiment], cache, keep=keep)
    return result


@given(order=st.lists(st.integers(0, len(EXPERIMENTS) - 1), min_size=1, max_size=6))
def test_a_run_is_the_same_whatever_was_in_the_cache_before(order):
    for number in order:
        found, alone = run(EXPERIMENTS[number], CACHE), ALONE[number]
        assert (found.outcome, found.metrics) == (alone.outcome, alone.metrics)


def test_series_are_the_same_too_and_stay_when_the_cache_is_used_again():
    cache, kept = RunCache(), []
    for number in (0, 6, 4, 0):
        kept.append((number, Series.joined([series for _, series in pieces_of(EXPERIMENTS[number], cache)])))
    for number, series in kept:
        for name, array in series.channels.items():
            assert array.tobytes() == ALONE[number].channels[name].tobytes(), name


def test_cached_models_move_as_compiled_wrists():
    experiment = EXPERIMENTS[6]
    nominal, timing, cache = experiment.nominal(), Timing.of(0.2, 1e-3, 1e-3), RunCache()
    parts = (experiment.law, Lissajous(), lambda time: np.full((len(time), 3), 0.004), timing, cache)
    plant = perturbed(nominal, experiment.perturbation)
    both = (
        Models.of(plant, nominal, timing, cache.engine),
        cache.models(WristFile(), experiment.perturbation, timing),
    )
    hardware = {"sensing": experiment.sensing, "actuation": experiment.actuation, "seed": experiment.seed}
    a, b = (finished(Running(models, *parts, **hardware)) for models in both)
    for name, array in a.channels.items():
        np.testing.assert_allclose(getattr(b, name), array, rtol=1e-6, atol=1e-8, err_msg=name)


@pytest.mark.parametrize("run", ALONE, ids=range(len(ALONE)))
def test_metrics_from_the_log_are_those_of_the_series(run):
    assert run.metrics == compute_metrics(run, run.measurement)


def pieces_of(experiment, cache):
    found, channels = [], channels_of(experiment.law, experiment.sensing, experiment.actuation)
    run(experiment, cache, lambda loop, logged: found.append((logged, logged.series(loop.wrist, channels))))
    return found


@pytest.mark.parametrize("number", [0, 6, 9])
def test_metrics_do_not_depend_on_the_pieces(number):
    experiment = EXPERIMENTS[number].replaced(duration=0.02)
    measurement = experiment.measurement(experiment.nominal())
    ((logged, _),) = pieces_of(experiment, CACHE)
    whole, parted, interpreted = (
        MetricAccumulator(measurement, engine) for engine in (CACHE.engine, CACHE.engine, interpreted_engine())
    )
    whole.add(logged)
    interpreted.add(logged)
    for first in range(0, len(logged.log), 7):
        parted.add(type(logged)(*(array[first : first + 7] for array in logged)))
    assert whole.result() == parted.result() == interpreted.result()


def test_what_is_not_a_number_is_not_passed_over():
    measurement = EXPERIMENTS[0].measurement(EXPERIMENTS[0].nominal())
    ((logged, series),) = pieces_of(EXPERIMENTS[0], CACHE)
    for row in (25, 30, len(series) - 1):
        log, error = logged.log.copy(), series.error.copy()
        log["error"][row] = error[row] = np.nan
        ours = MetricAccumulator(measurement, CACHE.engine)
        ours.add(logged._replace(log=log))
        for found in (ours.result(), compute_metrics(series.replaced(error=error), measurement)):
            assert np.isnan([found.rms_error_rad, found.max_error_rad]).all()
            assert np.isfinite([found.rms_tip_error_mm, found.max_tip_error_mm, found.peak_torque_Nm]).all()


def test_the_least_recently_used_value_goes_first():
    made, memory = [], LRU(2)

    def get(key):
        return memory.get(key, lambda: made.append(key) or len(made))

    assert [get(key) for key in "abab"] == [1, 2, 1, 2]
    assert [get(key) for key in "cba"] == [3, 2, 4]
    assert made == ["a", "b", "c", "a"]
    assert memory.get([], lambda: "no hash") == "no hash"


def test_laws_are_tried_and_packed_once_for_each():
    cache = RunCache()
    law = EXPERIMENTS[0].law
    assert cache.law(law, 1e-3) is cache.law(law, 1e-3)
    assert cache.law(law.replaced(K=0.01), 1e-3).packed.tobytes() != cache.law(law, 1e-3).packed.tobytes()
    run(EXPERIMENTS[0], cache)
    assert cache.checked_laws == {type(law)}


def test_what_is_kept_keeps_nothing_else_alive():
    """The pieces of a thinned series are not views of all rows."""
    pieces = []
    realistic = Experiment(duration=3.0, actuation="spherical_motor")
    simulate(realistic, record_every=100, keep_series=False, watch=pieces.append)
    arrays = [array for piece in pieces for array in piece.channels.values()]
    assert sum(len(piece) for piece in pieces) == 30
    assert all(array.base is None or array.base.nbytes <= array.nbytes for array in arrays)
