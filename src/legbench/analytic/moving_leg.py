"""State of one compiled leg on its way through its regimes, which all who watch it share."""

from legbench.analytic.compiled import foot_from_centre
from legbench.analytic.compiled_regime import CompiledRegime
from legbench.analytic.dual import floats, without_gradients
from legbench.analytic.equations import Pair
from legbench.analytic.float_leg import FloatLeg
from legbench.analytic.model import LegModel
from legbench.analytic.state import LegState, Regime
from legbench.analytic.stop_switches import StopSwitches
from legbench.analytic.terms import PairTerms


class MovingLeg:
    """Leg in motion: its angles, its place and its regime at the present time.

    Attributes:
        model: the leg.
        probe: factors p1, p2 of the probe `p1 q1 + p2 q2` that is watched [-].
        plain: the leg without derivatives, on which decisions are made; so are `plain_q`, `plain_v`
            and `plain_motor`.
        time: present time [s].
        began: time at which the present regime or piece began, zero for its integrator [s].
        elapsed: time since then [s].
        regime: regime whose equations hold.
        terms: inertia and gravity of the angles in this regime.
        q: angles [rad].
        v: rates [rad/s].
        motor: motor positions [rad].
        since: time at which the regime began [s].
        point: steady point of the angles at the beginning of the piece (forward, up) [m].
        drift: velocity of the steady point then [m/s].
        lost: energy lost in impacts with the ground since the leg was set to a state [J].
        compiled: the compiled regime.
        stop_switches: the joint stops.
        arm: lengths from which the foot tip follows, as seen from the centre of mass [m]; without
            derivatives `plain_arm`.
        quick: the plain leg, written out on floats.
        told: the state that was last made of this leg; None once the leg has moved on.
    """

    __slots__ = (
        "arm",
        "began",
        "compiled",
        "drift",
        "elapsed",
        "lost",
        "model",
        "motor",
        "plain",
        "plain_arm",
        "plain_motor",
        "plain_q",
        "plain_v",
        "point",
        "probe",
        "q",
        "quick",
        "regime",
        "since",
        "stop_switches",
        "terms",
        "time",
        "told",
        "v",
    )
    began: float
    compiled: CompiledRegime
    drift: Pair
    elapsed: float
    lost: float
    plain_motor: Pair
    plain_q: Pair
    plain_v: Pair
    point: Pair
    q: Pair
    regime: Regime
    since: float
    terms: PairTerms
    time: float
    v: Pair

    def __init__(self, model: LegModel, probe: Pair | None) -> None:
        self.model: LegModel = model
        self.plain: LegModel = without_gradients(model)
        self.probe: Pair = probe or (0.0, 0.0)
        self.arm = foot_from_centre(model)
        self.plain_arm = floats(self.arm)
        self.quick = FloatLeg(self.plain, self.plain_arm)
        self.stop_switches = StopSwitches(self.plain, self.quick)
        self.motor: Pair = (0.0, 0.0)
        self.told: LegState | None = None

    def centre(self) -> tuple[Pair, Pair]:
        """Place [m] and velocity [m/s] of the centre of mass in flight."""
        (x, z), (dx, dz) = self.point, self.drift
        elapsed = self.time - self.began
        fallen = self.model.floating.gravity * elapsed
        return (x + dx * elapsed, z + (dz - 0.5 * fallen) * elapsed), (dx, dz - fallen)
