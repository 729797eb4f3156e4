"""Is a curve in joint space a strict mode: does the leg, started on it, stay on it?

Two conditions, both geometric (section II-B, [15]). The curve is a geodesic of the inertia
metric, so that motion along it does not throw the leg off; and the force `tau - g`, turned into
an acceleration by M^-1, is tangent to it, so that nothing pushes the leg off.
"""

from dataclasses import dataclass

import numpy as np

from legbench.analytic.matrices import pair_coriolis
from legbench.modes.carry import Carrier
from legbench.modes.linear import RADIAL
from legbench.modes.scene import Scene
from legbench.signals import Floats

KNOTS = 200
"""Points at which a curve is looked at."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """Points, first and second derivatives by one parameter, each (n, 2)."""

    points: Floats
    tangent: Floats
    bend: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class Strictness:
    """How far a curve is from a strict mode; all zero on one."""

    geodesic: float
    """Largest curvature off the curve, by the inertia metric, per arc length [1/rad]."""
    force: float
    """Largest share of the force's acceleration that points off the curve [-]."""
    invariance: float
    """Largest distance from the curve of a leg started on it at rest [rad]."""


def radial_reach(scene: Scene) -> float:
    """How far z2 can go either way from rest before a joint reaches its limit [rad]."""
    (q1, q2), limits = scene.rest, scene.design.limits
    knee, hip = q2 - q1, q1
    return float(
        min(
            min(knee - limits.knee[0], limits.knee[1] - knee) / np.sqrt(2.0),
            min(hip - limits.hip[0], limits.hip[1] - hip) * np.sqrt(2.0),
        )
    )


def radial_line(scene: Scene, reach: float) -> Curve:
    """The line x1 = 0 through the rest posture, `reach` either way along z2 [rad]."""
    along = np.linspace(-reach, reach, KNOTS)[:, np.newaxis]
    points = np.asarray(scene.rest) + along * RADIAL
    tangent = np.broadcast_to(RADIAL, points.shape)
    return Curve(points=points, tangent=tangent, bend=np.zeros(points.shape))


def check(scene: Scene, curve: Curve, seconds: float) -> Strictness:
    """Measure both conditions along the curve, and their consequence by integration."""
    norm = np.linalg.norm(curve.tangent, axis=-1, keepdims=True)
    normal = np.stack([-curve.tangent[:, 1], curve.tangent[:, 0]], axis=-1) / norm
    mass = scene.mass(curve.points)
    swirl = pair_coriolis(scene.terms, curve.points, curve.tangent)
    turning = np.einsum("nij,nj->ni", swirl, curve.tangent)
    covariant = curve.bend + np.linalg.solve(mass, turning[..., np.newaxis])[..., 0]
    pushed = np.linalg.solve(mass, scene.force(curve.points)[..., np.newaxis])[..., 0]
    off_path = np.abs(np.sum(normal * covariant, axis=-1)) / norm[:, 0] ** 2
    off_force = np.abs(np.sum(normal * pushed, axis=-1))
    size = np.max(np.linalg.norm(pushed, axis=-1))
    return Strictness(
        geodesic=float(np.max(off_path)),
        force=float(np.max(off_force) / size),
        invariance=_strays(scene, curve, seconds),
    )


def _strays(scene: Scene, curve: Curve, seconds: float) -> float:
    start = np.concatenate([curve.points[-1], [0.0, 0.0]])
    path = Carrier(scene).path(start, np.linspace(0.0, seconds, 400))[:, :2]
    first, last = curve.points[:-1], curve.points[1:]
    way = last - first
    share = np.einsum("nki,ki->nk", path[:, np.newaxis] - first, way) / np.sum(way**2, axis=-1)
    share[:, 1:-1] = np.clip(share[:, 1:-1], 0.0, 1.0)
    share[:, 0], share[:, -1] = np.minimum(share[:, 0], 1.0), np.maximum(share[:, -1], 0.0)
    foot = first + share[..., np.newaxis] * way
    return float(np.max(np.min(np.linalg.norm(path[:, np.newaxis] - foot, axis=-1), axis=1)))
