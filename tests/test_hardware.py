"""Hardware that is not ideal, as a whole: in the loop, in recordings, on the command line, and as it is documented."""

import json
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigs import OPTIONAL, bits, finished, loop, one_line
from sampling import THOROUGH, pairs
from spherical_wrist import Experiment, load_recording, record, simulate
from spherical_wrist.actuation import Ideal as IdealActuation
from spherical_wrist.actuation import Realistic as RealisticActuation
from spherical_wrist.actuation import SphericalMotor
from spherical_wrist.actuation.drive import DRIVE
from spherical_wrist.control import FuzzySlidingComputedTorque
from spherical_wrist.control.contract import COMMAND, SIGNAL
from spherical_wrist.dynamics import MOTION
from spherical_wrist.errors import UnknownNameError
from spherical_wrist.experiment.description import with_changes
from spherical_wrist.experiment.perturbation import Start
from spherical_wrist.experiment.presets import HARDWARE, hardware
from spherical_wrist.inspection import inspect
from spherical_wrist.loop.loop import LOG, SETTINGS
from spherical_wrist.loop.outcome import Status
from spherical_wrist.parameters import unit_of
from spherical_wrist.prepare.physics import physics_model
from spherical_wrist.prepare.plant import Perturbation, perturbed
from spherical_wrist.sensing import Ideal as IdealSensing
from spherical_wrist.sensing import Realistic as RealisticSensing
from spherical_wrist.sensing.measure import SENSOR
from spherical_wrist.sensing.samples import SAMPLE
from spherical_wrist.wrist import Wrist
from test_actuation import compiled_map

CASES = {
    "noise and resolution": {"sensing": {"attitude_noise": 1e-3, "attitude_quantum": 5e-4, "rate_noise": 1e-2}},
    "estimated, late, lost": {
        "sensing": {"rate": "estimated", "rate_filter": 2e-3, "delay": 1.7e-3, "loss": 0.2, "attitude_noise": 1e-5}
    },
    "not timestamped": {"sensing": {"delay": 2e-3, "loss": 0.1, "timestamped": False}},
    "motors": {"actuation": {"torque_quantum": 1e-3, "lag": 7e-4, "cogging": 5e-3, "detents": 5}},
    "coils": {"actuation": {"name": "spherical_motor", "failed": [3], "strength_error": 0.05, "current_limit": 0.3}},
    "realistic": HARDWARE["realistic"],
}
each_case = pytest.mark.parametrize("case", CASES.values(), ids=CASES)


@each_case
def test_compiled_and_interpreted_agree(case):
    """The same source either way, to 1e-10 over 0.15 s of a badly started loop; by default over its beginning."""
    given = Experiment(duration=0.15 if THOROUGH else 0.04, physics_period=5e-4, initial_error=(0.2, -0.1, 0.3), **case)
    machine, plain = simulate(given), simulate(given, interpreted=True)
    assert machine.channels.keys() == plain.channels.keys()
    for name in machine.channels:
        np.testing.assert_allclose(machine.channels[name], plain.channels[name], rtol=0.0, atol=1e-10, err_msg=name)
    assert np.abs(machine.error).max() > 0.1


@pytest.mark.parametrize("record", [DRIVE, SENSOR, SAMPLE, LOG, SETTINGS, SIGNAL, COMMAND, MOTION], ids=str)
def test_no_field_of_a_record_is_named_like_something_that_numpy_records_have(record):
    """Interpreted, ``record.mean`` would be NumPy's mean, whatever field of that name there is."""
    assert not [name for name in record.names if hasattr(np.record, name)]


@pytest.mark.parametrize(("name", "samples"), pairs(CASES, [1, 7]))
def test_the_same_run_comes_in_pieces_of_any_size(nominal, engine, name, samples):
    """Faults are drawn and kept from call to call, whatever a call's length."""
    case = CASES[name]
    given = Experiment(duration=0.2, **case)
    plant = perturbed(nominal, Perturbation(friction=given.friction))
    found = []
    for size in (8192, samples):
        parts = {"sensing": given.sensing, "actuation": given.actuation, "seed": 3}
        begin = Start(error=(0.1, 0.0, -0.2))
        law = FuzzySlidingComputedTorque()
        running = loop(law, nominal, engine, plant=plant, duration=0.2, step=5e-4, start=begin, **parts)
        found.append(finished(running, size))
    assert bits(found[0]) == bits(found[1])


@each_case
def test_a_run_depends_on_its_experiment_alone(case):
    given = Experiment(duration=0.1, **case)
    first = simulate(given)
    simulate(Experiment(duration=0.1, sensing="realistic", actuation="realistic", seed=4))
    assert bits(simulate(given)) == bits(first)
    assert bits(simulate(Experiment(**json.loads(json.dumps(given.model_dump(mode="json")))))) == bits(first)


def test_every_part_of_the_realistic_hardware_has_its_effect():
    """Switched off one by one, each changes what is recorded: none is silently not applied."""
    realistic = {"duration": 3.0, **HARDWARE["realistic"]}  # long enough for a sample to be lost
    whole = bits(simulate(Experiment(**realistic)))
    faults = {"sensing": RealisticSensing(), "actuation": RealisticActuation()}
    for part, given in faults.items():
        off = IdealSensing() if part == "sensing" else SphericalMotor()
        for name in type(given).model_fields:
            if getattr(given, name) != getattr(off, name):
                less = simulate(Experiment(**realistic | {part: given.replaced(**{name: getattr(off, name)})}))
                assert bits(less)["attitude"] != whole["attitude"], name
    assert bits(simulate(Experiment(**realistic | {"friction": 0})))["attitude"] != whole["attitude"]


# --- in recordings ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("every", [1, 7])
def test_what_hardware_does_is_recorded_bit_for_bit(tmp_path, every):
    given = Experiment(duration=0.5, law="adaptive_fuzzy_sliding_computed_torque", **HARDWARE["realistic"])
    run = simulate(given, record_every=every)
    record(run, tmp_path / "run.rrd")
    back = load_recording(tmp_path / "run.rrd")
    assert bits(back) == bits(run)
    widths = {name: back.channels[name].shape for name in OPTIONAL}
    rows = len(range(0, 500, every))
    assert widths == {
        "law_state": (rows, run.law_state.shape[1]),
        "measured_attitude": (rows, 4),
        "measured_rate": (rows, 3),
        "commanded_torque": (rows, 3),
        "current": (rows, 24),
        "condition": (rows,),
    }
    assert back.metrics == run.metrics
    assert back.measurement == run.measurement
    assert back.experiment == given


def test_inspection_recomputes_the_figures_of_the_coils(tmp_path):
    run = simulate(Experiment(duration=0.5, **HARDWARE["realistic"]))
    record(run, tmp_path / "run.rrd")
    found = inspect(tmp_path / "run.rrd")
    found.check()
    assert found.recomputed.copper_loss_W == pytest.approx(run.metrics.copper_loss_W, rel=1e-9)
    assert found.recomputed.peak_current_A == run.metrics.peak_current_A > 0.0
    assert found.recomputed.max_condition_number == run.metrics.max_condition_number > 1.0
    thinned = simulate(Experiment(duration=0.5, **HARDWARE["realistic"]), record_every=5)
    record(thinned, tmp_path / "thin.rrd")
    inspect(tmp_path / "thin.rrd").check()


def test_a_run_that_diverges_is_recorded(tmp_path):
    """With everything that was measured and driven up to there."""
    law = {"name": "pd", "P": 1e3, "D": 0}
    run = simulate(Experiment(law=law, duration=2.0, initial_error=1.0, sensing={"delay": 0.05}, actuation="realistic"))
    record(run, tmp_path / "run.rrd")
    assert bits(load_recording(tmp_path / "run.rrd")) == bits(run)
    assert run.outcome.status in {Status.DIVERGED, Status.COMPLETED}


# --- on the command line ---------------------------------------------------------------------------------------------


def test_the_preset_is_the_parts_bundled(wrist):
    code, out, _ = wrist("run", "--hardware", "realistic", "--duration", "0.2", "--json", "--seed", "3")
    bundled = simulate(Experiment(duration=0.2, seed=3, **HARDWARE["realistic"]))
    by_hand = Experiment(duration=0.2, seed=3, sensing="realistic", actuation="realistic", friction=1e-3)
    assert code == 0
    assert json.loads(out)["metrics"]["rms_error_rad"] == bundled.metrics.rms_error_rad
    assert bundled.experiment == by_hand
    assert load_recording("wrist.rrd").experiment == by_hand


def test_ideal_hardware_takes_the_place_of_what_a_file_has(wrist, tmp_path):
    (tmp_path / "e.toml").write_text(
        'sensing = "realistic"\nactuation = "realistic"\nfriction = 0.01\nduration = 0.1\n'
    )
    assert wrist("run", "e.toml", "--hardware", "ideal")[0] == 0
    assert load_recording("wrist.rrd").experiment == Experiment(duration=0.1)


def test_values_of_a_preset_can_be_changed(wrist):
    code, _, _ = wrist("run", "--hardware", "realistic", "--duration", "0.1", "--set", "sensing.delay=0.0015")
    assert code == 0
    told = load_recording("wrist.rrd").experiment
    assert told.sensing == RealisticSensing(delay=1.5e-3)
    assert told.actuation == RealisticActuation()


def test_hardware_of_no_known_name_is_refused_in_one_line(wrist):
    code, out, err = wrist("run", "--hardware", "realist")
    assert (code, out) == (2, "")
    assert "did you mean 'realistic'" in err
    assert err.count("\n") == 1
    with pytest.raises(UnknownNameError) as caught:
        hardware("perfect")
    one_line(caught.value)


def test_what_was_run_is_printed(wrist):
    _, out, _ = wrist("run", "--hardware", "realistic", "--duration", "0.1")
    flat = " ".join(out.split())
    for part in ("friction 0.001 N·m", "sensing realistic", "actuation realistic", "copper loss", "coil current, peak"):
        assert part in flat
    _, out, _ = wrist("run", "--set", "sensing.delay=0.002", "--duration", "0.1")
    assert "sensing ideal but for delay 0.002 s" in " ".join(out.split())
    assert "copper" not in out


# --- as documented ---------------------------------------------------------------------------------------------------


README = (Path(__file__).parents[1] / "models" / "README.md").read_text(encoding="utf-8")
SECTION = README[README.index("## Non-ideal hardware") : README.index("## Bringing your own model")]
ROW = re.compile(r"^\| `(sensing|actuation)\.(\w+)`[^|]*\|([^|]*)\| ([^|]+) \| ([^|]+) \|$", re.MULTILINE)


def value_of(text):
    """A value as the tables write it."""
    words = {"none": (), "true": True, "false": False}
    text = text.strip()
    if text in words:
        return words[text]
    try:
        return float(text)
    except ValueError:
        return text


def told_values(part):
    return {
        name: (unit.strip(), value_of(a), value_of(b)) for of, name, unit, a, b in ROW.findall(SECTION) if of == part
    }


@pytest.mark.parametrize(
    ("part", "default", "realistic"),
    [
        ("sensing", IdealSensing(), RealisticSensing()),
        ("actuation", SphericalMotor(), RealisticActuation()),
    ],
)
def test_the_tables_are_those_of_the_classes(part, default, realistic):
    """Every parameter of sensors and motors is documented once, with its unit, default and realistic value."""
    told = told_values(part)
    assert set(told) == set(type(default).model_fields)
    assert len(ROW.findall(SECTION)) == len(told_values("sensing")) + len(told_values("actuation"))
    for name, (unit, *values) in told.items():
        assert unit == unit_of(type(default), name), name
        for member, value in zip((default, realistic), values, strict=True):
            real = getattr(member, name)
            per_axis = name == "rate_bias"
            assert real == ((value,) * 3 if per_axis else value), name


def test_coils_without_faults_have_the_defaults_of_ideal_motors():
    for name in IdealActuation.model_fields:
        assert getattr(SphericalMotor(), name) == getattr(IdealActuation(), name)


def test_the_table_of_friction_is_that_of_the_preset():
    (row,) = re.findall(r"^\| `friction` \| N·m \| ([^|]+) \| ([^|]+) \|$", SECTION, re.MULTILINE)
    assert [float(value) for value in row] == [Experiment().friction, HARDWARE["realistic"]["friction"]]


@pytest.mark.parametrize(
    ("settings", "rms", "chattering"),
    re.findall(r"^\| (.+) \| (\d\.\de-\d) \| ([\d.]+) \|$", SECTION, re.MULTILINE),
    ids=lambda text: text if len(text) > 9 else "",
)
def test_the_effect_of_each_part_is_as_documented(settings, rms, chattering):
    """On the default run, to the digits that are printed."""
    tables = dict(HARDWARE["realistic"]) if "--hardware realistic" in settings else {}
    for text in re.findall(r"`([^`]+)`", settings) if not tables else []:
        for setting in text.split():
            name, _, value = setting.partition("=")
            given = [3] if value == "[3]" else False if value == "false" else value_of(value)
            tables = with_changes(tables, {name: given})
    metrics = simulate(Experiment(**tables), keep_series=False).metrics
    assert metrics.rms_error_rad == pytest.approx(float(rms), abs=0.055 * 10.0 ** int(rms[-2:]))
    assert f"{metrics.chattering_Nm_per_s:.2g}" == f"{float(chattering):.2g}"


def test_there_are_as_many_effects_as_parts():
    rows = re.findall(r"^\| (.+) \| \d\.\de-\d \| [\d.]+ \|$", SECTION, re.MULTILINE)
    assert len(rows) == 17


def number_after(label):
    (text,) = re.findall(rf"^\| {re.escape(label)} \| ([\d.]+)", SECTION, re.MULTILINE)
    return float(text)


def test_figures_of_the_default_motor():
    """Condition numbers over a grid of attitudes, largest torques at home, and the loss of the default run."""
    motor = SphericalMotor()
    home = np.linalg.pinv(compiled_map((1.0, 0.0, 0.0, 0.0), motor))
    across, _, about = motor.current_limit / np.abs(home).max(axis=0)
    assert number_after("torque at the current limit, at home, across the tool") == pytest.approx(across, abs=5e-4)
    assert number_after("torque at the current limit, at home, about the tool") == pytest.approx(about, abs=5e-4)
    loss = simulate(Experiment(actuation="spherical_motor")).metrics.copper_loss_W
    assert number_after("copper loss on the default run") == pytest.approx(loss, abs=0.05)
    grid = np.stack(np.meshgrid(np.arange(0.0, 1.45, 0.1), np.arange(0.0, 6.28, 0.2618), np.arange(0.0, 6.28, 0.2618)))
    tilt, azimuth, spin = grid.reshape(3, -1)
    tilted = Rotation.from_rotvec(np.stack([tilt * np.cos(azimuth), tilt * np.sin(azimuth), 0.0 * tilt], axis=1))
    turned = (tilted * Rotation.from_rotvec(np.outer(spin, [0.0, 0.0, 1.0]))).as_quat(scalar_first=True)
    some = turned[:: len(turned) // 1500]
    whole = np.array([compiled_map(q, motor) for q in some])
    worst = np.linalg.cond(whole).max()
    label = "largest condition number, any spin, tilt up to 1.4 rad"
    assert 0.99 * number_after(label) < worst < number_after(label) + 5e-3
    working = np.delete(whole, 3, axis=2)
    worst = np.linalg.cond(working).max()
    assert 0.97 * number_after("the same with coil 3 failed and known") < worst
    assert worst < number_after("the same with coil 3 failed and known") + 5e-3
    random = np.random.default_rng(0).normal(size=(len(some), 3))
    random /= np.linalg.norm(random, axis=1, keepdims=True)
    currents = np.einsum("nji,ni->nj", np.linalg.pinv(whole), random)
    least = (motor.current_limit / np.abs(currents).max(axis=1)).min()
    label = "torque at the current limit, any direction, tilt up to 1.4 rad, at least"
    assert number_after(label) < least < 1.15 * number_after(label)


def test_figures_in_the_text():
    """The rest of the section's numbers: what they are made of."""
    assert RealisticSensing().attitude_quantum == pytest.approx(2.0 * np.pi / 2**16, rel=2e-3)
    assert RealisticSensing().attitude_noise == pytest.approx(np.deg2rad(1.0 / 60.0), rel=5e-3)
    assert RealisticSensing().rate_noise == pytest.approx(np.deg2rad(2.8e-3) * np.sqrt(500.0), rel=1e-2)
    assert RealisticSensing().delay == 0.5 * Experiment().control_period
    assert RealisticActuation().torque_quantum == pytest.approx(0.5 / 2**12, rel=2e-2)
    assert f"{1.0 / (2.0 * np.pi * RealisticActuation().lag):.0f} Hz" in SECTION
    assert HARDWARE["realistic"]["friction"] == pytest.approx(0.01 * 0.03 * 3.3, rel=2e-2)
    assert RealisticActuation().cogging == pytest.approx(0.01 * 0.20, rel=0.3)
    fast = {
        "law": "computed_torque",
        "disturbance": 0,
        "mass_scale": 1,
        "actuation": "spherical_motor",
        "duration": 3.0,
    }
    shown, real = re.search(
        r"shows (\S+) rad of largest error instead of (\S+) rad", SECTION.replace("\n", " ")
    ).groups()
    assert simulate(Experiment(**fast)).metrics.max_error_rad == pytest.approx(float(shown), rel=0.05)
    fine = simulate(Experiment(**fast, physics_period=1.25e-4)).metrics
    assert fine.max_error_rad == pytest.approx(float(real), rel=0.05)


def test_figures_of_dry_friction(nominal):
    """Creep under 90 % of 1e-3 N·m, as documented, and what MuJoCo's defaults would give."""
    told = [float(text) for text in re.findall(r"(\d\.\de-\d) rad/s", SECTION[SECTION.index("### Dry friction") :])]
    plant = perturbed(nominal, Perturbation(friction=1e-3, damping=-1e-4))
    soft = plant.spec.copy()
    soft.joints[0].solref_friction, soft.joints[0].solimp_friction = [0.02, 1.0], [0.9, 0.95, 0.001, 0.5, 2.0]
    found = []
    for wrist in (plant, Wrist.of(soft)):
        model = physics_model(wrist, 1e-3)
        data = mujoco.MjData(model)
        data.qfrc_applied[:] = [0.0, 0.0, 0.9e-3]
        mujoco.mj_step(model, data, 500)
        found.append(data.qvel[2])
    np.testing.assert_allclose(told, found, rtol=0.02)


COMMANDS = re.findall(r"^wrist (run .*?)(?:  +#.*)?$", SECTION, re.MULTILINE)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_commands_run(wrist, command):
    code, out, err = wrist(*command.split(), "--duration", "0.1", "--json")
    assert (code, err) == (0, "")
    told = load_recording("wrist.rrd").experiment
    assert json.loads(out)["outcome"] == "completed"
    assert told.sensing != IdealSensing() or told.actuation != IdealActuation()


def test_there_are_commands():
    assert len(COMMANDS) == 5
