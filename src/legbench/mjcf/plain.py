"""The model without what other engines for MJCF refuse, such as MJX and MuJoCo Warp."""

import mujoco

from legbench.mjcf.xml import to_xml


def plain_xml(spec: mujoco.MjSpec) -> str:
    """MJCF text of a compiled spec without contact sensor, energy flag and `autoreset`.

    Neither of them changes how the leg moves: the sensor and the energy are only read, and
    `autoreset` decides what happens after a simulation has diverged.
    """
    plain = spec.copy()
    for sensor in list(plain.sensors):
        if sensor.type == mujoco.mjtSensor.mjSENS_CONTACT:
            plain.delete(sensor)
    plain.option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    plain.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    plain.compile()
    return to_xml(plain)
