"""Backdrop and light of models that have none."""

import mujoco

from spherical_wrist.wrist import Wrist

BRIGHT, DARK = (0.93, 0.95, 0.97), (0.62, 0.67, 0.73)
"""Backdrop from top to bottom, as of the wrist that comes with the package."""

AMBIENT, DIFFUSE = 0.35, 0.55
"""Headlight of a model that has no light of its own; MuJoCo's would leave it in the dark."""

LARGEST_SHADOW, SLICES, STACKS = 2048, 48, 16
"""Size of shadow maps, and pieces of round geoms. More is hardly visible, and doubles the time in software."""


def dressed_model(wrist: Wrist, size: tuple[int, int]) -> mujoco.MjModel:
    """Compile the model of a wrist for pictures of a size [px], with a backdrop and light if it has none.

    The wrist is left as it is. Bodies, joints, geoms and cameras have the same indices.
    """
    spec = wrist.spec.copy()
    kinds = [texture.type for texture in spec.textures]
    if mujoco.mjtTexture.mjTEXTURE_SKYBOX not in kinds:
        gradient = {"builtin": mujoco.mjtBuiltin.mjBUILTIN_GRADIENT, "rgb1": BRIGHT, "rgb2": DARK}
        spec.add_texture(type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=512, height=512, **gradient)
    model = spec.compile()
    if not model.nlight:
        model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = AMBIENT, DIFFUSE
    model.vis.global_.offwidth, model.vis.global_.offheight = size
    quality = model.vis.quality
    quality.shadowsize = min(quality.shadowsize, LARGEST_SHADOW)
    quality.numslices, quality.numstacks = SLICES, STACKS
    return model
