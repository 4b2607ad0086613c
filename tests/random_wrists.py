"""Random wrists: MJCF with a ball joint, three motors, and any of what MuJoCo lets act on a joint."""

from collections.abc import Callable
from typing import Any

import numpy as np

Slots = dict[str, str]
Random = np.random.Generator

GEOM = '<geom type="capsule" size="{r:.4f} {l:.4f}" pos="{x}" euler="{e}" mass="{m:.4f}" {more}/>'


def numbers(*values: Any) -> str:
    """Numbers as in an attribute of MJCF."""
    return " ".join(f"{value:.6g}" for value in np.ravel(values))


def _geom(random: Random, more: str = "") -> str:
    return GEOM.format(
        r=random.uniform(0.002, 0.02), l=random.uniform(0.01, 0.04), x=numbers(random.uniform(-0.03, 0.03, 3)),
        e=numbers(random.uniform(-1.5, 1.5, 3)), m=random.uniform(0.02, 0.3), more=more,
    )  # fmt: skip


def _joint(random: Random) -> Slots:
    return {
        "joint": f'armature="{random.uniform(0.0, 1e-3):.6g}" stiffness="{numbers(random.uniform(0.0, 0.2, 3))}"',
        "damping": numbers(random.uniform(0.0, 1e-3, 3)),
    }


def _compensation(random: Random) -> Slots:
    found = {part: f'gravcomp="{random.uniform(-0.5, 1.5):.4f}"' for part in ("rotor", "tool", "grip")}
    found.pop(str(random.choice(list(found))))
    if random.random() < 0.5:
        found["joint"] = 'actuatorgravcomp="true"'
    return found


def _tendons(random: Random) -> Slots:
    """Springs, dampers and inertia of cables, some around a wheel, over a pulley, or between moving sites."""
    cables = ""
    for kind in range(int(random.integers(1, 4))):
        path, inertia = '<site site="anchor"/><site site="pull"/>', random.uniform(0.0, 0.1)
        if kind == 1:
            inertia = 0.0  # MuJoCo takes none around a wheel
            path = '<site site="anchor"/><geom geom="wheel" sidesite="beside"/><site site="pull"/>'
        elif kind == 2:
            path = '<site site="anchor"/><site site="pull"/><pulley divisor="2"/><site site="other"/><site site="tip"/>'
        cables += (
            f'<spatial stiffness="{numbers(random.uniform(0.0, 30.0, 2))}" armature="{inertia:.4g}" '
            f'damping="{numbers(random.uniform(0.0, 0.5, 2))}" springlength="{random.uniform(0.0, 0.05):.4f}">'
            f"{path}</spatial>"
        )
    return {"tendons": cables}


def _tight_tendons(random: Random) -> Slots:
    """Cables that end, and that rub."""
    return {
        "tendons": f'<spatial name="leash" range="0 {random.uniform(0.02, 0.1):.4f}" limited="true" '
        f'frictionloss="{random.choice([0.0, 0.1]):g}" stiffness="5"><site site="anchor"/><site site="pull"/></spatial>'
    }


def _fluid(random: Random) -> Slots:
    shape = 'fluidshape="ellipsoid" fluidcoef="0.5 0.25 1.5 1 1"' if random.random() < 0.5 else ""
    given = f'density="{random.uniform(0, 1500):.5g}" viscosity="{random.uniform(0, 0.5):.5g}"'
    return {"option": f'{given} wind="{numbers(random.normal(0.0, 1.0, 3))}"', "geom": shape}


def _motors(random: Random) -> Slots:
    damping, armature = numbers(random.uniform(0.0, 1e-3, 2)), f"{random.uniform(0.0, 1e-3):.5g}"
    return {"motor": f'damping="{damping}" armature="{armature}"'}


def _equality(random: Random) -> Slots:
    connect = f'<connect body1="tool" anchor="{numbers(random.uniform(-0.02, 0.02, 3))}" solref="0.1 1"/>'
    weld = '<weld name="held" body1="rotor" solref="0.05 1"/>'
    active = "true" if random.random() < 0.8 else "false"
    return {"equality": str(random.choice([connect, weld])).replace("solref", f'active="{active}" solref')}


def _contacts(random: Random) -> Slots:
    floor = f'<geom name="floor" type="plane" size="1 1 1" pos="0 0 {random.uniform(-0.05, 0.1):.4f}" conaffinity="1"/>'
    sticky = f'adhesion="{random.uniform(0, 1):.3f}"' if random.random() < 0.3 else ""
    return {"world": floor, "geom": f'contype="1" friction="{random.uniform(0.1, 1):.3f}" {sticky}'}


def _limit(random: Random) -> Slots:
    return {"joint": f'limited="true" range="0 {random.uniform(0.1, 2.0):.4f}"'}


def _friction(random: Random) -> Slots:
    return {"joint": f'frictionloss="{random.uniform(1e-3, 0.1):.5f}"'}


def _held(random: Random) -> Slots:
    """Joints before and after the ball, with springs, a motor and a coupling of their own."""
    hinge = f'axis="{numbers(random.normal(size=3))}" stiffness="3" damping="0.01" armature="0.01"'
    return {
        "carrier": f'<joint name="slide" type="slide" axis="1 0 0"/>{_geom(random)}',
        "hinges": f'<joint name="bend" type="hinge" {hinge}/><joint name="twist" type="hinge" {hinge}/>',
        "equality": '<joint joint1="bend" joint2="twist"/>',
        "tendons": '<fixed name="differential" stiffness="2"><joint joint="bend" coef="1"/>'
        '<joint joint="twist" coef="-1"/></fixed>',
        "actuators": '<position joint="bend" kp="5"/><motor tendon="differential"/>',
    }


def _flex(random: Random) -> Slots:
    """A stretched elastic thread between the world and the wrist."""
    points = numbers([0.0, 0.0, 0.2], random.uniform(-0.03, 0.03, 3), random.uniform(-0.2, 0.2, 3), [0.0, 0.0, -0.02])
    return {
        "flexes": f'<flex dim="1" body="world rotor world tool" vertex="{points}" element="0 1 1 2 2 3" radius="0.001">'
        f'<edge stiffness="{random.uniform(1, 30):.4g}" damping="{random.uniform(0, 1):.4g}"/>'
        '<contact selfcollide="none" contype="0" conaffinity="0"/></flex>'
    }


def _flags(random: Random) -> Slots:
    names = ("gravity", "spring", "damper", "equality", "frictionloss", "limit", "contact", "filterparent")
    return {"flags": " ".join(f'{name}="disable"' for name in random.choice(names, 2, replace=False))}


FEATURES: dict[str, Callable[[Random], Slots]] = {
    maker.__name__.lstrip("_"): maker
    for maker in (
        _joint, _compensation, _tendons, _tight_tendons, _fluid, _motors, _equality, _contacts, _limit, _friction,
        _held, _flex, _flags,
    )
}  # fmt: skip
"""Features of MuJoCo that add to the dynamics of a joint, or that change which of them count."""


def random_mjcf(seed: int, without: str = "") -> tuple[str, set[str]]:
    """Return the MJCF of a random wrist, and its features: each one in turn, with a few others.

    Args:
        seed: seed of the wrist.
        without: feature to leave out, while all others stay as they are.
    """
    random = np.random.default_rng(seed)
    names = list(FEATURES)
    chosen = {names[seed % len(names)], *map(str, random.choice(names, 3, replace=False))} - {without}
    slots = dict.fromkeys(
        ("joint", "rotor", "tool", "grip", "option", "flags", "geom", "world", "carrier", "hinges", "motor",
         "equality", "tendons", "actuators", "flexes", "damping"), "",
    )  # fmt: skip
    for number, name in enumerate(names):
        if name in chosen:
            for slot, text in FEATURES[name](np.random.default_rng([seed, number])).items():
                slots[slot] = f"{slots[slot]} {text}"
    axes = random.normal(size=(3, 3)) + 2.0 * np.eye(3)
    motors = "".join(f'<motor joint="w" gear="{numbers(axis)}" {slots["motor"]}/>' for axis in axes)
    place = f'pos="{numbers(random.uniform(-0.1, 0.1, 3))}" euler="{numbers(random.uniform(-1.0, 1.0, 3))}"'
    integrator = random.choice(["RK4", "Euler", "implicit", "implicitfast"])
    text = f"""
    <mujoco>
      <compiler angle="radian"/>
      <option timestep="0.001" integrator="{integrator}" gravity="{numbers(random.normal(0.0, 6.0, 3))}"
              {slots["option"]}><flag {slots["flags"]}/></option>
      <default><geom contype="0" conaffinity="0"/></default>
      <worldbody>
        {slots["world"]}
        <site name="anchor" pos="0.03 0.01 0.05"/><site name="other" pos="-0.05 0.02 0"/>
        <body name="carrier" {place}>
          {slots["carrier"]}
          <geom name="wheel" type="sphere" size="0.01" pos="0.02 0 0"/><site name="beside" pos="0.02 0 0.02"/>
          <body name="rotor" {place} {slots["rotor"]}>
            <joint name="w" type="ball" pos="{numbers(random.uniform(-0.01, 0.01, 3))}"
                   damping="{slots["damping"] or "1e-4"}" {slots["joint"]}/>
            {_geom(random, slots["geom"])}
            <site name="pull" pos="{numbers(random.uniform(-0.03, 0.03, 3))}"/>
            <body name="tool" {place} {slots["tool"]}>
              {slots["hinges"]} {_geom(random, slots["geom"])} <site name="tip" pos="0 0.01 -0.08"/>
              <body {place} {slots["grip"]}>{_geom(random)}</body>
            </body>
          </body>
        </body>
      </worldbody>
      <tendon>{slots["tendons"]}</tendon>
      <deformable>{slots["flexes"]}</deformable>
      <equality>{slots["equality"]}</equality>
      <actuator>{motors}{slots["actuators"]}</actuator>
    </mujoco>"""
    return text, chosen
