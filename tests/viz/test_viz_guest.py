"""A controller that is not built in: its own signals and phases in every picture."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import viz_rrd
from viz_runs import part, record

from legbench.design.setup import SetupKind
from legbench.phases import ControllerDescription, PhaseInfo, Role
from legbench.recording.controller_table import controller_table
from legbench.recording.reader import Recording, described
from legbench.signals import Signal
from legbench.viz.facts import as_markdown, facts_of
from legbench.viz.live.blueprint import blueprint
from legbench.viz.live.rrd import write_rrd
from legbench.viz.print.figures import phase_figure
from legbench.viz.print.save import save_figure

TARGET = Signal("target", ("hip", "knee"), "rad", "set point")
EFFORT = Signal("effort", (), "W", "power asked for")
SAID = ControllerDescription(
    phases=tuple(
        PhaseInfo(code=code, name=name, role=Role.ACTING)
        for code, name in ((20, "out"), (21, "back"), (22, "hold"), (23, "wait"))
    ),
    signals=(TARGET, EFFORT),
)


@pytest.fixture
def guest(tmp_path: Path) -> Recording:
    """A leg with a fixed trunk under a controller with four phases and two signals."""
    run = record(tmp_path, SetupKind.HFTS, 1200)
    chosen = {"kind": "mine.py:Sine", "settings": {"freq": 3.1}}
    experiment = {**run.manifest["experiment"], "controller": chosen}
    manifest = {
        **run.manifest,
        "experiment": experiment,
        "controller": controller_table("mine.py:Sine", SAID),
    }
    effort = np.where(run.time < 0.1, np.nan, run.time)
    columns = {
        **run.columns,
        "phase": np.where(run.columns["phase"] == 3, 20, 21).astype(np.int8),
        "target_hip": -run.time,
        "target_knee": run.time,
        "effort": effort,
    }
    return replace(run, manifest=manifest, described=described(manifest, run.path), columns=columns)


def test_own_signals_and_phases_are_shown(guest: Recording, tmp_path: Path) -> None:
    shown = viz_rrd.temporal(write_rrd(guest, tmp_path / "guest.rrd"))
    target = np.array(shown["/series/own/target"]["scalars"])
    np.testing.assert_allclose(target, np.stack([-guest.time, guest.time], axis=-1))
    effort = shown["/series/own/effort"]
    np.testing.assert_allclose(np.ravel(effort["scalars"]), guest.time[100:])
    states = [state[0] for state in shown["/states/controller"]["state"]]
    assert set(states) == {"out", "back"}


def test_each_own_signal_has_a_tab_with_its_unit(guest: Recording) -> None:
    facts = facts_of(guest.description)
    names = _view_names(blueprint(facts, room=(0.0, 1.0), span=(0.0, 1.0)).root_container)
    assert {"target [rad]", "effort [W]"} <= set(names)


def _view_names(container: object) -> list[str]:
    inside, name = getattr(container, "contents", None), getattr(container, "name", None)
    parts = inside if isinstance(inside, list | tuple) else []
    return [str(name), *(each for part in parts for each in _view_names(part))]


def test_a_figure_of_a_guest_is_coloured_by_period(guest: Recording) -> None:
    figure = phase_figure(guest)
    assert "mine.py:Sine" in figure.get_suptitle()
    *_, target, effort, bar = figure.axes
    assert len(figure.axes) == 6
    assert bar.get_ylabel() == "oscillation period"
    assert target.get_title(loc="left") == "(d) target: set point"
    assert target.get_ylabel() == "target [rad]"
    hip, knee = target.get_lines()
    assert (hip.get_label(), knee.get_label()) == ("hip", "knee")
    np.testing.assert_array_equal(hip.get_ydata(), -guest.time)
    np.testing.assert_array_equal(knee.get_xdata(), guest.time)
    assert effort.get_title(loc="left") == "(e) effort: power asked for"
    assert effort.get_ylabel() == "effort [W]"
    np.testing.assert_array_equal(effort.get_lines()[0].get_ydata(), guest["effort"])
    np.testing.assert_array_equal(guest["target"][:, 1], guest.time)
    np.testing.assert_array_equal(part(guest, 0, 300)["effort"][100:], guest.time[100:300])


def test_own_signals_come_below_the_differences_and_those_of_both_runs_are_laid_over(
    guest: Recording,
) -> None:
    figure = phase_figure(guest, [part(guest, 0, 900)])
    radial, joint, target, effort = figure.axes[3:7]
    titles = [each.get_title(loc="left")[:3] for each in (radial, joint, target, effort)]
    assert titles == ["(d)", "(e)", "(f)", "(g)"]
    assert target.get_position().y1 < radial.get_position().y0
    lines = target.get_lines()
    assert [len(np.asarray(line.get_xdata())) for line in lines] == [1200, 1200, 900, 900]
    assert len(figure.axes) == 8


@pytest.mark.parametrize(
    "count", [1, 3, *(pytest.param(n, marks=pytest.mark.long) for n in (2, 12))]
)
def test_every_own_signal_has_a_panel_and_dollars_are_no_mathematics(
    guest: Recording, count: int, tmp_path: Path
) -> None:
    own = tuple(Signal(f"own{n}", (), "$", "price $x_ in $") for n in range(count))
    said = replace(SAID, signals=own)
    manifest = {**guest.manifest, "controller": controller_table("mine.py:Sine", said)}
    columns = {**guest.columns, **{signal.name: guest.time for signal in own}}
    run = replace(
        guest, manifest=manifest, described=described(manifest, guest.path), columns=columns
    )
    figure = phase_figure(run)
    panels = figure.axes[3 : 3 + count]
    assert [panel.get_ylabel() for panel in panels] == [f"own{n} [\\$]" for n in range(count)]
    assert len({panel.get_title(loc="left").split(")")[0] for panel in panels}) == count
    assert save_figure(figure, tmp_path / "own.svg", dpi=30).stat().st_size > 0


def test_the_facts_of_a_guest_are_its_settings(guest: Recording) -> None:
    text = as_markdown(facts_of(guest.description))
    assert "- kind: mine.py:Sine" in text
    assert "- freq: 3.1" in text
