"""Warnings of MuJoCo while it steps, which go to stderr and into a file of the present folder."""

import mujoco


def silence() -> None:
    """Drop MuJoCo's warnings, unless somebody has installed a handler for them.

    A plant finds a simulation that diverges by itself, and names the cause.
    """
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(_drop)


def _drop(_message: str) -> None:
    pass
