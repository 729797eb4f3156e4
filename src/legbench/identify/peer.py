"""Second opinion on stiffness and damping: `mujoco.sysid` on the same runs, in MuJoCo's own model.

Controls are expanded to the step of the model, and there is one model for each run. The posture
in which a run begins is free where ours is: taken from a noisy encoder instead, it bends the
stiffness by several standard errors.
"""

import sys
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np

from legbench.design import LegDesign
from legbench.design.setup import Setup
from legbench.errors import ConfigError
from legbench.identify._sysid import load_sysid
from legbench.identify.outcome import Identification
from legbench.identify.staged import IdentificationTask
from legbench.identify.trial import FitTrial
from legbench.metrics.changes import rows_before_change
from legbench.mjcf import BuildOptions, Linkage, LinkageKind, build_spec, rest_qpos
from legbench.plant.start import PERIOD
from legbench.signals import Floats

FREED: Final = ("k1", "k2", "d1", "d2")
"""Parameters that the peer can free."""
LEAST, MOST = 0.2, 5.0
"""Bounds of the peer's search, as factors of the design [-]."""
START_REACH: Final = 0.05
"""Largest way of a link at the start from where its encoder shows it [rad]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PeerAnswer:
    """What the peer found."""

    values: dict[str, float]
    """Parameters [N m/rad, N m s/rad]."""
    seconds: float
    """Wall time that it took [s]."""

    def lines(self, outcome: Identification) -> list[str]:
        """Lines for people: its values beside ours."""
        ours = {each.name: each.value for each in outcome.estimates}
        rows = [
            f"{name:<12} {value:>12.6g} {1e2 * (value / ours[name] - 1.0):>+9.4f} % of ours"
            for name, value in self.values.items()
            if name in ours
        ]
        return [f"mujoco.sysid, {self.seconds:.1f} s", *rows]


def ask_peer(task: IdentificationTask) -> PeerAnswer:
    """Fit the same runs with `mujoco.sysid`.

    Raises:
        MissingExtraError: it is not installed.
        ConfigError: something other than stiffness and damping is free, or a run begins in motion.
    """
    other = [name for name in task.free.names if name not in FREED]
    if other:
        raise ConfigError(f"the peer frees {', '.join(FREED)} alone, not {', '.join(other)}")
    if any(trial.moving for trial in task.trials):
        raise ConfigError("the peer needs runs that begin at rest")
    sysid = load_sysid()
    parameters = sysid.ParameterDict()
    for name in task.free.names:
        parameters.add(_parameter(sysid, name, task.design))
    for trial in task.trials if task.free.start else ():
        for name, angle in zip(_start_names(trial), _first(trial).tolist(), strict=True):
            parameters.add(sysid.Parameter(name, angle, angle - START_REACH, angle + START_REACH))
    each = [_residual_of_run(sysid, trial, task) for trial in task.trials]

    def residual(vector: Floats, known: Any, **options: Any) -> tuple[list[Any], ...]:
        parts = [residual_of_run(vector, known, **options) for residual_of_run in each]
        return tuple([one for part in parts for one in part[place]] for place in range(3))

    before = time.perf_counter()
    with redirect_stdout(sys.stderr):  # what it says of its progress is no result
        found, _ = sysid.optimize(parameters, residual, verbose=False)
    values = {name: float(found[name].value[0]) for name in task.free.names}
    return PeerAnswer(values=values, seconds=time.perf_counter() - before)


def _parameter(sysid: Any, name: str, design: LegDesign) -> Any:
    joint = int(name[1]) - 1
    value = (design.stiffness if name[0] == "k" else design.damping)[joint]
    if value <= 0.0:
        raise ConfigError(f"{name} of the design is zero; the peer needs a start above it")
    modifier = _stiffens(joint) if name[0] == "k" else _damps(joint)
    return sysid.Parameter(name, value, LEAST * value, MOST * value, modifier=modifier)


def _stiffens(joint: int) -> Callable[[mujoco.MjSpec, Any], None]:
    """Writer of a spring's stiffness, which is the gain of a position actuator."""

    def write(spec: mujoco.MjSpec, parameter: Any) -> None:
        actuator = spec.actuator(f"motor_{joint + 1}")
        actuator.gainprm[0] = parameter.value[0]
        actuator.biasprm[1] = -parameter.value[0]

    return write


def _damps(joint: int) -> Callable[[mujoco.MjSpec, Any], None]:
    """Writer of a damping, which belongs to a joint or to the tendon that stands for q2."""

    def write(spec: mujoco.MjSpec, parameter: Any) -> None:
        crank = spec.joint("crank")
        part = spec.joint("hip") if joint == 0 else spec.tendon("q2") if crank is None else crank
        damping = np.array(part.damping)
        damping[0] = parameter.value[0]
        part.damping = damping

    return write


def _start_names(trial: FitTrial) -> tuple[str, str]:
    """Names of the parameters that are the link angles at the start of a run."""
    return f"start_1 of {trial.name}", f"start_2 of {trial.name}"


def _first(trial: FitTrial) -> Floats:
    """Mean of the measured link angles before the motors first move (2,) [rad]."""
    still = max(1, int(rows_before_change(trial.motor_pos)))
    return trial.joint_pos[:still].mean(axis=0)


def _residual_of_run(sysid: Any, trial: FitTrial, task: IdentificationTask) -> Callable[..., Any]:
    """Residual of one run, which begins at rest where its own parameters say."""
    return sysid.build_residual_fn(
        models_sequences=[_sequence(sysid, trial, task)],
        modify_residual=_residual_of(task.bars is not None),
        custom_rollout=_rollout(sysid, trial, task.design) if task.free.start else None,
    )


def _rollout(sysid: Any, trial: FitTrial, design: LegDesign) -> Callable[..., Any]:
    """Rollout whose initial state follows from the start parameters of a run."""

    def roll(models: Any, initial_states: Any, param_dicts: Any, **options: Any) -> Any:
        states = [
            sysid.create_initial_state(
                model,
                rest_qpos(
                    model, design, np.array([known[name].value[0] for name in _start_names(trial)])
                ),
            )
            for model, known in zip(models, param_dicts, strict=True)
        ]
        return sysid.sysid_rollout(models=models, initial_states=states, **options)

    return roll


def _sequence(sysid: Any, trial: FitTrial, task: IdentificationTask) -> Any:
    """Model and measurement of one run, with the motors at every step of the model."""
    bars = task.bars
    linkage = (
        Linkage(kind=LinkageKind.REDUCED)
        if bars is None
        else Linkage(bar_density=bars.density, crank_length=bars.crank_length)
    )
    options = BuildOptions(setup=Setup(kind=trial.setup), linkage=linkage)
    spec = build_spec(task.design, options)
    for sensor in list(spec.sensors):
        spec.delete(sensor)
    for joint in ("1", "2"):
        spec.add_sensor(
            name=f"link_{joint}",
            type=mujoco.mjtSensor.mjSENS_ACTUATORPOS,
            objtype=mujoco.mjtObj.mjOBJ_ACTUATOR,
            objname=f"motor_{joint}",
        )
    model = spec.compile()
    parts = round(PERIOD / model.opt.timestep)
    # A rollout leaves out the step of the last control, so there is one more.
    held = np.concatenate([trial.motor_pos[1:], trial.motor_pos[-1:]])
    motors = np.repeat(held, parts, axis=0)
    times = model.opt.timestep * np.arange(len(motors))
    return sysid.ModelSequences(
        trial.name,
        spec,
        trial.name,
        sysid.create_initial_state(model, rest_qpos(model, task.design, _first(trial))),
        sysid.TimeSeries.from_control_names(times, motors, model),
        sysid.TimeSeries.from_names(trial.time, trial.joint_pos, model),
    )


def _residual_of(bars: bool) -> Callable[..., Any]:
    """Difference of predicted and measured link angles, from the state after each step.

    Sensors of a rollout are those before the step.
    """

    def difference(
        parameters: Any, predicted: Any, measured: Any, model: Any, every: bool, *, state: Floats,
        **_: object,
    ) -> tuple[Floats, Any, Any]:  # fmt: skip
        # The state's first column is the time after each step.
        places = np.searchsorted(state[:, 0], measured.times[1:] - 0.5 * model.opt.timestep)
        rows = state[places, 1 : 1 + model.nq]
        hip = rows[:, model.joint("hip").qposadr[0]]
        knee = rows[:, model.joint("crank" if bars else "knee").qposadr[0]]
        links = np.stack([hip, knee if bars else hip + knee], axis=1)
        return (links - measured.data[1:]), predicted, measured

    return difference
