"""A plant of one's own, around another: the simulated leg seen through noisy encoders.

legbench run jump --design models/prototype.toml --plant scripts/examples/own_plant.py:Noisy
"""

from dataclasses import dataclass, replace

import numpy as np

from legbench.plant.abstract import AbstractPlant
from legbench.plants import SimChoice


@dataclass(frozen=True, kw_only=True)
class Noisy:
    kind = "noisy"
    noise: float = 1e-3
    """Standard deviation of the measured link angles [rad]."""

    def open(self, leg):
        return NoisyPlant(SimChoice().open(leg).plant, self.noise)


class NoisyPlant(AbstractPlant):
    def __init__(self, inner, noise):
        self.inner, self.noise, self.period = inner, noise, inner.period

    def reset(self):
        self.random = np.random.default_rng(0)
        return self.seen(self.inner.reset())

    def step(self, command):
        return self.seen(self.inner.step(command))

    def seen(self, true):
        return replace(true, joint_pos=true.joint_pos + self.random.normal(0.0, self.noise, 2))

    def close(self):
        self.inner.close()
