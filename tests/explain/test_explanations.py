"""What an explanation says: checks against the paper, words, files, and an early end."""

import json
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from legbench.cli import main
from legbench.design import load_design
from legbench.design.setup import SetupKind
from legbench.errors import MissingExtraError
from legbench.experiment import load_experiment
from legbench.experiment.run import run
from legbench.metrics import Analysis
from legbench.paper import published

pytest.importorskip("heyoka")
pytest.importorskip("matplotlib")

from legbench.explain import consistency
from legbench.explain.causes import causes_named
from legbench.explain.consistency import Predicted, StatementCheck, checks_of, predict
from legbench.explain.content import explanation_content
from legbench.explain.engine import Watch
from legbench.explain.explanation import Explanation, JudgedFit, Scope, explain
from legbench.explain.fitting import CauseFit
from legbench.explain.jumping import PredictedHop, hops_of
from legbench.explain.motor_end import MotorEnd
from legbench.explain.screening import ScreeningMethod, screen
from legbench.explain.targets import Target, step_target
from legbench.explain.words import explanation_lines, sentences
from legbench.imperfections import Imperfections
from legbench.servo import PERFECT

MODELS = Path(__file__).parents[2] / "models"
PROTOTYPE = load_design(MODELS / "prototype.toml")
NUMBERS = published()
QUICK = Target(name="quick", z2=1.0, dz2=0.3, shape=(0.98, 0.9, 0.82), setup=SetupKind.HFTS)
HOP = PredictedHop(
    stance=0.995,
    flight=0.96,
    foot_clearance=0.034,
    trunk_excursion=0.111,
    drift=0.003,
    cause=None,
)


def test_the_explained_leg_decays_as_the_paper_says() -> None:
    experiment = load_experiment(MODELS / "experiments" / "explained.toml")
    target = step_target("text")
    assert replace(experiment, imperfections=PERFECT).design == PROTOTYPE
    recording = run(experiment)
    assert recording.complete
    ratings = Analysis(recording).ratings.equilibrium.periods
    assert len(ratings) >= len(target.shape)
    found = np.array(ratings[: len(target.shape)])
    assert np.all(np.diff(found) < 0.0)
    assert found[0] == pytest.approx(NUMBERS["step_rating_1"].value, abs=0.02)
    assert found[-1] == pytest.approx(NUMBERS["step_rating_6"].value, abs=0.02)
    assert np.allclose(found, target.shape, rtol=0.0, atol=target.tolerance)


def predicted(
    *, level: float = 0.95, hfts: float = 0.9, vfts: float = 0.92, ffs: float = 0.8
) -> Predicted:
    step = {SetupKind.HFTS: hfts, SetupKind.VFTS: vfts, SetupKind.FFS: ffs}
    return Predicted(
        bang_bang=np.array([level]),
        steps={
            setup: np.array([[0.9, value, np.nan if setup is SetupKind.HFTS else 0.1]])
            for setup, value in step.items()
        },
        folded={
            SetupKind.HFTS: (np.array([0.9]), np.array([0.95])),
            SetupKind.VFTS: (np.array([0.94]), np.array([0.95])),
        },
    )


def test_statements_of_the_paper_hold_or_fail() -> None:
    checks = {check.name: check for check in checks_of(predicted(), 0, HOP, NUMBERS)}
    assert {name: check.held for name, check in checks.items()} == {
        "bang-bang": True,
        "hfts-over-ffs": True,
        "vfts-over-ffs": False,  # in the third period, which hfts lacks
        "vfts-over-hfts": True,
        "hfts-declines": False,
        "vfts-declines": True,
        "hfts-folded": True,
        "vfts-folded": False,
        "jump-stance": True,
        "jump-flight": False,
    }
    assert checks["hfts-over-ffs"].value == pytest.approx(0.1)
    assert checks["vfts-folded"].value == pytest.approx(0.01)
    other = checks_of(predicted(level=0.965, ffs=0.95), 0, None, NUMBERS)
    assert [check.held for check in other[:2]] == [False, False]
    assert len(other) == 8
    gone = checks_of(predicted(hfts=np.nan, level=np.nan), 0, replace(HOP, stance=np.nan), NUMBERS)
    assert not gone[0].held
    assert not gone[-2].held


@pytest.mark.long
def test_predictions_are_of_every_setup(monkeypatch: pytest.MonkeyPatch) -> None:
    for setup, duration in ((SetupKind.FFS, 2.8), (SetupKind.HFTS, 0.9), (SetupKind.VFTS, 0.9)):
        monkeypatch.setitem(consistency.DURATIONS, setup, duration)
    legs = [PERFECT, Imperfections(stiffness_error=(-0.06, 0.06), guide_damping=(0.1, 0.1))]
    found = predict(PROTOTYPE, QUICK, NUMBERS, legs)
    assert found.bang_bang.shape == (2,)
    assert found.bang_bang[0] > 0.98 > found.bang_bang[1] > 0.7
    assert set(found.steps) == {SetupKind.HFTS, SetupKind.VFTS, SetupKind.FFS}
    for ratings in found.steps.values():
        assert np.all(ratings[0] > ratings[1])
    for lower, usual in found.folded.values():
        assert np.isfinite([lower, usual]).all()


@pytest.mark.long
def test_a_spring_mismatch_costs_the_hop_its_rating() -> None:
    perfect, apart = hops_of(PROTOTYPE, [PERFECT, Imperfections(stiffness_error=(-0.04, 0.04))])
    assert perfect.cause is None
    assert perfect.stance > 0.99
    assert perfect.flight > 0.97 > apart.flight
    assert 0.03 < perfect.foot_clearance < 0.04
    assert perfect.trunk_excursion > perfect.foot_clearance


def test_stopped_early_it_returns_what_there_is() -> None:
    rated: list[int] = []
    watch = Watch(advance=rated.append, stopped=lambda: sum(rated) >= 4)
    some = causes_named(["friction", "stiffness-apart"])
    found = explain(PROTOTYPE, QUICK, some, NUMBERS, Scope(pairs=True), watch)
    assert not found.complete
    assert len(found.sensitivities) == 3
    assert found.pairs == ()
    assert found.proposals == ()
    assert "Stopped before the end" in sentences(found)[-1]
    assert explanation_lines(found)


def whole_explanation() -> Explanation:
    names = (["link-zero-polar", "guide-upward"], ["stiffness-apart", "damping"])
    fits = [
        CauseFit(
            causes=causes_named(pair),
            sizes=(0.02, 0.2),
            ratings=(0.97, 0.9, 0.83),
            misfit=0.4,
            worst=0.5,
        )
        for pair in names
    ]
    alone = replace(fits[0], causes=fits[0].causes[:1], sizes=(0.03,), misfit=2.0, worst=3.0)
    checks = (StatementCheck(name="bang-bang", words="ffs, bang-bang", value=0.95, held=True),)
    judged = [JudgedFit(fit=fit, checks=checks, hop=HOP) for fit in fits]
    perfect = replace(alone, causes=(), sizes=())
    ends = MotorEnd(
        setup=SetupKind.HFTS, z2=1.8, farthest=1.33, ends=(1.33, 1.25), levels=(0.98, 0.95)
    )
    return Explanation(
        design=PROTOTYPE,
        target=QUICK,
        perfect=JudgedFit(fit=perfect, checks=checks, hop=HOP),
        sensitivities=(),
        screened=(),
        singles=(alone,),
        pairs=tuple(fits),
        judged=tuple(judged),
        ends=(ends, replace(ends, setup=SetupKind.FFS, farthest=0.83)),
        proposals=(),
        complete=True,
    )


def test_words_name_what_cannot_be_told_apart() -> None:
    found = whole_explanation()
    text = "\n".join(sentences(found))
    assert text.startswith("No single cause reaches the target: the nearest, a zero error of the")
    assert "cannot tell 2 explanations apart" in text
    assert "link-zero-polar + guide-upward; stiffness-apart + damping" in text
    assert "a range that ends at 1.25 rad or earlier lowers the rating from 0.980" in text
    assert "in ffs takes motor 2 to 0.83 rad only: an end that lowers the others" in text
    more = "\n".join(sentences(replace(found, judged=found.judged[:1] * 2, pairs=found.pairs * 2)))
    assert "cannot tell 4 explanations apart" in more
    assert "in every period, 2 of which are link-zero-polar + guide-upward" in more
    table = "\n".join(explanation_lines(found))
    assert "A  link-zero-polar + guide-upward: 1 of 1 hold" in table
    assert "jump, height of the foot [mm]" in table
    assert found.experiment is not None
    # What guides the trunk is not there with a fixed trunk.
    assert found.experiment.imperfections == Imperfections(link_zero=(0.02, 0.02))
    content = json.loads(json.dumps(explanation_content(found)))
    assert content["alike"] == [fit.name for fit in found.alike]
    assert content["judged"][0]["checks"][0]["held"] is True


def test_the_command_writes_numbers_experiment_and_figures(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    flags = ["--design", str(MODELS / "prototype.toml"), "--reading", "caption", "--no-setups"]
    status = main(
        ["explain", *flags, "--causes", "link-zero-polar", "--out", str(tmp_path / "x"), "--json"]
    )
    assert status == 0
    shown = capfd.readouterr()
    assert "effects one at a time: 3 legs" in shown.err
    content = json.loads(shown.out)
    assert content.pop("out") == str(tmp_path / "x")
    assert content == json.loads((tmp_path / "x" / "explain.json").read_text())
    best = content["judged"][0]
    assert best["causes"][0]["cause"] == "link-zero-polar"
    assert 0.015 < abs(best["causes"][0]["size"]) < 0.04
    experiment = load_experiment(tmp_path / "x" / "explained.toml")
    assert experiment.imperfections.link_zero == pytest.approx([best["causes"][0]["size"]] * 2)
    assert (tmp_path / "x" / "explain.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "x" / "explain.svg").read_text()


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--causes", "fricton"], "no cause 'fricton'; did you mean friction?"),
        (["--against", "nowhere.csv"], "nowhere.csv: no such file of published numbers"),
        (["--design", "nowhere.toml"], "nowhere.toml"),
    ],
)
def test_bad_input_is_refused_in_one_line(
    flags: list[str], words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert main(["explain", "--design", str(MODELS / "prototype.toml"), *flags]) == 2
    shown = capfd.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert words in shown.err


def test_screening_weighs_what_matters() -> None:
    some = causes_named(["link-zero-polar", "foot-inertia"])
    if find_spec("SALib") is None:
        with pytest.raises(MissingExtraError, match=r"pip install 'legbench\[screening\]'"):
            screen(PROTOTYPE, QUICK, some, ScreeningMethod.MORRIS, 0)
        return
    rows = screen(PROTOTYPE, QUICK, some, ScreeningMethod.MORRIS, 0)
    assert [row.cause.name for row in rows] == ["link-zero-polar", "foot-inertia"]
    assert rows[0].whole > 10.0 * rows[1].whole
    sobol = screen(PROTOTYPE, QUICK, some, ScreeningMethod.SOBOL, 0)
    assert sobol[0].cause.name == "link-zero-polar"
    assert sobol[0].whole > 0.9
