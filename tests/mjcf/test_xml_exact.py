import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from mjcf_legs import LINKAGES, SETUPS, options

from legbench.design import LegDesign
from legbench.mjcf import Numerics, build_spec, to_xml

PHYSICS = [
    "body_mass",
    "body_inertia",
    "body_ipos",
    "body_iquat",
    "body_pos",
    "body_quat",
    "jnt_type",
    "jnt_pos",
    "jnt_axis",
    "jnt_range",
    "jnt_limited",
    "jnt_solref",
    "jnt_solimp",
    "dof_damping",
    "dof_armature",
    "dof_frictionloss",
    "site_pos",
    "tendon_damping",
    "wrap_prm",
    "actuator_gainprm",
    "actuator_biasprm",
    "actuator_trnid",
    "actuator_forcelimited",
    "actuator_ctrllimited",
    "eq_solref",
    "eq_solimp",
    "eq_data",
    "eq_obj1id",
    "eq_obj2id",
    "pair_solref",
    "pair_solimp",
    "pair_friction",
    "pair_dim",
    "pair_margin",
    "key_qpos",
    "key_ctrl",
    "qpos0",
    "sensor_type",
    "sensor_objid",
    "sensor_refid",
]
OPTIONS = [
    "timestep",
    "integrator",
    "solver",
    "cone",
    "iterations",
    "tolerance",
    "impratio",
    "gravity",
    "disableflags",
    "enableflags",
    "density",
    "viscosity",
]


def awkward(design: LegDesign) -> LegDesign:
    """The same leg with numbers of which none is short in decimal."""
    l1, l3 = design.thigh.length / math.pi * 3.0, design.foot.length / math.e * 2.6
    return replace(
        design,
        name='odd "name" <&>',
        trunk_mass=design.trunk_mass * math.sqrt(1.1),
        thigh=replace(design.thigh, length=l1, mass=0.1 + 0.2, inertia=1e-4 / 3.0),
        shank=replace(design.shank, length=l1 + l3, com=0.2 / 3.0),
        foot=replace(design.foot, length=l3, mass=math.exp(-3.3), com=0.02 / 3.0),
        stiffness=(math.pi, math.e),
        damping=(0.01 / 3.0, 0.02 / 7.0),
        limits=replace(design.limits, knee=(0.1 + 0.2, 2.9 * (1.0 - 1e-16))),
    )


@pytest.mark.parametrize("linkage", LINKAGES)
@pytest.mark.parametrize("setup", SETUPS)
def test_what_is_saved_is_what_is_run_to_the_last_bit(
    optimal: LegDesign, setup: str, linkage: str
) -> None:
    spec = build_spec(awkward(optimal), options(setup, linkage))
    built = spec.compile()
    read = mujoco.MjModel.from_xml_string(to_xml(spec))
    for name in PHYSICS:
        mine, theirs = np.asarray(getattr(built, name)), np.asarray(getattr(read, name))
        assert mine.shape == theirs.shape, name
        assert np.array_equal(mine, theirs), f"{name}: {mine} is read back as {theirs}"
    for name in {"tip", "ground"} & {geom.name for geom in spec.geoms}:
        assert np.array_equal(built.geom(name).pos, read.geom(name).pos)
        assert np.array_equal(built.geom(name).size, read.geom(name).size)
    assert np.allclose(built.geom_pos, read.geom_pos, atol=1e-6)
    assert np.allclose(built.geom_size, read.geom_size, atol=1e-6)
    for name in OPTIONS:
        mine, theirs = getattr(built.opt, name), getattr(read.opt, name)
        assert np.array_equal(mine, theirs), f"option {name}: {mine} is read back as {theirs}"


def test_solver_settings_are_written_out(optimal: LegDesign) -> None:
    text = to_xml(build_spec(optimal, options("jump", "bars")))
    for setting in (
        'timestep="0.00025"',
        'integrator="RK4"',
        'cone="elliptic"',
        'solver="Newton"',
        'iterations="50"',
        'tolerance="1e-12"',
    ):
        assert setting in text
    assert text.count("solref=") == text.count("solimp=") == 3
    assert text.count("solreflimit=") == text.count("solimplimit=") == 2


def test_every_setting_of_the_numerics_reaches_the_model(optimal: LegDesign) -> None:
    numerics = Numerics(
        timestep=0.0005,
        loop_solref=(0.001, 0.9),
        loop_solimp=(0.91, 0.92, 0.003, 0.4, 3.0),
        contact_solref=(0.003, 0.8),
        contact_solimp=(0.93, 0.94, 0.004, 0.3, 4.0),
        stop_solref=(0.005, 0.7),
        stop_solimp=(0.95, 0.96, 0.005, 0.2, 5.0),
        iterations=77,
        tolerance=1e-9,
    )
    spec = build_spec(optimal, replace(options("jump", "bars"), numerics=numerics))
    model = mujoco.MjModel.from_xml_string(to_xml(spec))
    assert (model.opt.timestep, model.opt.iterations, model.opt.tolerance) == (0.0005, 77, 1e-9)
    assert model.eq_solref.tolist() == [[0.001, 0.9]] * model.neq
    assert np.array_equal(model.eq_solimp, [numerics.loop_solimp] * model.neq)
    assert np.array_equal(model.pair_solref, [numerics.contact_solref])
    assert np.array_equal(model.pair_solimp, [numerics.contact_solimp])
    for joint in ("hip", "knee"):
        index = model.joint(joint).id
        assert np.array_equal(model.jnt_solref[index], numerics.stop_solref)
        assert np.array_equal(model.jnt_solimp[index], numerics.stop_solimp)
