"""Campaign files: what they may say, and how they are refused."""

from pathlib import Path

import pytest
from campaigns import BASE, GRID, MODELS, SMALL, planned, written

from legbench.campaign import load_campaign, plan_campaign
from legbench.control import BangBangConfig, JumpConfig
from legbench.design.setup import SetupKind
from legbench.errors import CampaignError, ConfigError
from legbench.experiment import experiment_hash, load_experiment
from legbench.experiment.overrides import overlaid
from legbench.experiment.tables import read_toml


def test_cells_are_those_of_experiment_files(tmp_path: Path) -> None:
    """Independent path: the same settings written into experiment files one by one."""
    plan = planned(tmp_path)
    wanted = []
    for z2 in (1.0, 1.2):
        for dz2 in (0.1, 0.2):
            for trial in (0, 1):
                text = BASE.replace("[base]", "").replace("seed = 5", f"seed = {5 + trial}")
                text += f"controller.settings.z2 = {z2}\ncontroller.settings.dz2 = {dz2}\n"
                wanted.append(experiment_hash(load_experiment(written(tmp_path, text, "one.toml"))))
    assert [each.hash for each in plan.planned] == wanted
    assert [each.trial for each in plan.planned] == [0, 1] * 4
    assert [each.cell for each in plan.planned] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert plan.axes == ("controller.settings.dz2", "controller.settings.z2", "seed")
    assert plan.cells == 4


def test_keys_may_be_nested_or_quoted(tmp_path: Path) -> None:
    nested = GRID.replace('"', "")
    first, second = (planned(tmp_path, BASE + text) for text in (GRID, nested))
    assert [each.hash for each in first.planned] == [each.hash for each in second.planned]


def test_blocks_lists_and_what_they_share(tmp_path: Path) -> None:
    text = (
        BASE
        + """
[grid]
"design.trunk.mass" = [600, 657]
[[cells]]
name = "pairs"
trials = 3
list = [{controller.settings.z2 = 1.0}, {controller.settings.z2 = 1.1, duration = 0.2}]
[[cells]]
set."setup.kind" = "hfts"
grid.controller.kind = ["bang-bang", "position-jump"]
"""
    )
    plan = planned(tmp_path, text)
    assert [(each.block, each.trial) for each in plan.planned] == [
        *[("pairs", trial) for _ in range(4) for trial in range(3)],
        *[("cells.1", 0)] * 4,
    ]
    masses = [each.experiment.design.trunk_mass for each in plan.planned]
    assert masses == [0.6, 0.6, 0.6, 0.657, 0.657, 0.657] * 2 + [0.6, 0.6, 0.657, 0.657]
    # Another kind of controller has none of the settings of the one that it replaces.
    swings = [each.experiment for each in plan.planned if each.experiment.controller.kind != "x"]
    assert swings[12].controller == BangBangConfig()
    assert "duration" in plan.axes
    assert "controller.settings.threshold" not in plan.axes


def test_a_base_file_brings_its_own_paths_and_usual_setup(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    (tmp_path / "leg.toml").write_text((MODELS / "prototype.toml").read_text())
    base = 'design = "../leg.toml"\nduration = 0.2\ncontroller.kind = "bang-bang"\n'
    written(tmp_path / "below", base, "base.toml")
    text = 'base = "below/base.toml"\n[grid]\ncontroller.kind = ["bang-bang", "jump"]\n'
    swing, hop = [each.experiment for each in planned(tmp_path, text).planned]
    assert swing == load_experiment(tmp_path / "below" / "base.toml")
    assert (hop.controller, hop.setup.kind) == (JumpConfig(), SetupKind.JUMP)


def test_exclusions_take_cells_out(tmp_path: Path) -> None:
    text = SMALL + (
        '[[exclude]]\n"controller.settings.z2" = 1.2\n"controller.settings.dz2" = 0.2\n'
    )
    plan = planned(tmp_path, text)
    assert plan.cells == 3
    assert len(plan.planned) == 6
    assert plan.excluded == ({"controller.settings.z2": 1.2, "controller.settings.dz2": 0.2},)


def test_cells_that_are_the_same_are_run_once(tmp_path: Path) -> None:
    text = SMALL.replace("[1.0, 1.2]", "[1.0, 1.2, 1.0]")
    plan = planned(tmp_path, text)
    assert len(plan.planned) == 8
    assert plan.repeated == 4


def test_changes_replace_what_the_file_says(tmp_path: Path) -> None:
    path = written(tmp_path, SMALL)
    plan = plan_campaign(load_campaign(path, {"controller.settings.dz2": 0.15, "duration": 0.1}))
    assert {each.experiment.duration for each in plan.planned} == {0.1}
    assert plan.axes == ("controller.settings.z2", "seed")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            SMALL.replace("settings.z2", "settings.zz2"),
            ("controller.settings.zz2: unknown key; did you mean 'z2'?", "cells: "),
        ),
        (
            SMALL.replace('"controller.settings.z2"', '"controler.settings.z2"'),
            ("controler: unknown key; did you mean 'controller'?",),
        ),
        (
            SMALL.replace("trials = 2", "trails = 2"),
            ("trails: unknown key; did you mean 'trials'?",),
        ),
        (
            SMALL.replace("trials = 2", "trials = 0"),
            ("trials: is 0; it must be a whole number from 1",),
        ),
        (
            SMALL.replace("[0.1, 0.2]", "0.1"),
            ("grid.controller.settings.dz2", "must be a list of values"),
        ),
        (
            SMALL.replace("[0.1, 0.2]", "[]"),
            ("grid.controller.settings.dz2: is []; it must be a list",),
        ),
        (
            SMALL.replace("[0.1, 0.2]", '["a", "b"]'),
            ("controller.settings.dz2: is 'a'; it must be a number", "'b'"),
        ),
        (
            BASE + GRID + '[[cells]]\nset."controller.settings.z2" = 1.0\n',
            ("cells.0.controller.settings.z2: is given twice",),
        ),
        (SMALL + "[[exclude]]\nseed = 7\n", ("exclude.0: matches no cell",)),
        (
            SMALL + "[[exclude]]\n'controller.settings.z3' = 7\n",
            ("no cell has this key; did you mean 'controller.settings.z2'?",),
        ),
        ('infeasible = "run"\n' + BASE, ("infeasible: is 'run'; known are refuse, skip",)),
        ("format = 2\n" + BASE, ("format is 2; this legbench reads campaign format 1",)),
        ("base = 3\n", ("base: is 3; it must be a table or the path of an experiment file",)),
        ('base = "not.toml"\n', ("not.toml: no such experiment file",)),
        ("cells = 3\n" + BASE, ("cells: is 3; it must be a list of tables",)),
        ("list = [3]\n" + BASE, ("list: is [3]; it must be a list of tables",)),
        ('name = "a/b"\n' + BASE, ("name: is 'a/b'; it must be a text without '/'",)),
        ("a = ", ("not valid TOML",)),
        ("", ("is empty; write it anew",)),
        ("# nothing\n", ("cells: design: is missing; controller: is missing",)),
    ],
)
def test_what_makes_no_sense_is_told_in_one_line(
    text: str, words: tuple[str, ...], tmp_path: Path
) -> None:
    with pytest.raises(ConfigError) as refused:
        planned(tmp_path, text)
    for word in words:
        assert word in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"not\.toml: no such campaign file"):
        load_campaign(tmp_path / "not.toml")


def test_a_million_cells_are_asked_back_with_size_and_time(tmp_path: Path) -> None:
    many = ", ".join(f"{0.8 + 1e-6 * place:.6f}" for place in range(1000))
    some = ", ".join(f"{0.1 + 1e-6 * place:.6f}" for place in range(1000))
    lines = many.replace(", ", ",\n"), some.replace(", ", ",\n")
    text = SMALL.replace("1.0, 1.2", lines[0]).replace("0.1, 0.2", lines[1])
    with pytest.raises(
        CampaignError,
        match=r"has 2000000 experiments, some 3\.33 h on one processor; up to 10000 .* say --large",
    ):
        planned(tmp_path, text)


def test_overlaying_leaves_the_base_as_it_was(tmp_path: Path) -> None:
    path = written(tmp_path, BASE)
    tables = read_toml(path)["base"]
    overlaid(tables, "controller.settings.z2", 1.3, tmp_path)
    assert "z2" not in tables["controller"]["settings"]
