"""What the watch over the links looks at briefly is doubted as if it had looked at all of it."""

import math
from dataclasses import replace

import pytest
from guard_rig import BOUNDS, REST, pair, see_links

from legbench.limits.plausibility import LinkWatch

BOTH = (True, True)


def see(
    watch: LinkWatch, links: tuple[float, float], fresh: tuple[bool, bool] = BOTH
) -> str | None:
    """What is said of links in a cycle, in which motors and commands rest."""
    doubt = see_links(watch, links, fresh=fresh)
    return None if doubt is None else f"{doubt.cause}: {doubt.message}"


def test_a_link_that_is_at_its_mirror_place_has_moved() -> None:
    for axis in (0, 1):
        watch = LinkWatch(BOUNDS)
        assert see(watch, REST) is None
        told = str(see(watch, pair(axis, -REST[axis], REST[1 - axis])))
        assert told.startswith(f"joint speed: joint {axis + 1} moved by 1.000 rad in 1 cycles")


@pytest.mark.parametrize("axis", [0, 1])
def test_a_cycle_without_news_is_made_up_for_once_and_not_again(axis: int) -> None:
    """A link may turn by 60 mrad a cycle; one that was not heard for one may turn by twice that."""
    watch = LinkWatch(BOUNDS)
    assert see(watch, REST) is None
    assert see(watch, REST, (axis != 0, axis != 1)) is None
    assert see(watch, REST) is None
    assert see(watch, REST) is None
    moved = see(watch, pair(axis, REST[axis] + 0.1, REST[1 - axis]))
    assert str(moved).startswith(f"joint speed: joint {axis + 1} moved by 0.100 rad in 1 cycles")


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_link_that_swings_to_its_mirror_place_makes_the_other_one_stand(
    axis: int, side: float
) -> None:
    # 20 ms, in which link 1 or 2 is at 0.3 rad first, and at -0.3 rad then.
    watch = LinkWatch(replace(BOUNDS, joint_speed=math.inf, sway=math.inf))
    shown = [0.3 * side] + [-0.3 * side] * 20
    told = [see(watch, pair(axis, angle, REST[1 - axis])) for angle in shown]
    assert told[:19] == [None] * 19
    assert str(told[19]).startswith(f"joint encoder: joint {2 - axis} stands at")
    assert "in which the other one moved by 0.600 rad" in str(told[19])
    assert told[20] is None
