import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from legbench.design import LegDesign, Limits, Segment, load_design, save_design
from legbench.design.toml import design_from_mapping, design_to_mapping
from legbench.errors import DesignError

BY_LAW = settings(derandomize=True, max_examples=50, deadline=None)
POSITIVE = st.floats(1e-6, 1e3)
WHOLE = """
name = "a leg"
[units]
mass = "g"
length = "mm"
inertia = "kg mm^2"
angle = "deg"
[trunk]
mass = 637
[thigh]
mass = 207
length = 64
com = 10
inertia = 446
[shank]
mass = 126
length = 133
com = 67
inertia = 140
[foot]
mass = 30
length = 69
com = 10
inertia = 70
[springs]
stiffness = [3.124, 3.124]
damping = [0.0073, 0.0]
[limits]
hip = [-126.0, 51.5]
knee = [17.2, 166.0]
"""


def loaded(tmp_path: Path, text: str) -> LegDesign:
    path = tmp_path / "leg.toml"
    path.write_text(text, encoding="utf-8")
    return load_design(path)


@st.composite
def designs(draw: st.DrawFn) -> LegDesign:
    l1, l3 = draw(POSITIVE), draw(POSITIVE)

    def segment(length: float) -> Segment:
        com = length * draw(st.floats(0.0, 1.0))
        return Segment(mass=draw(POSITIVE), length=length, com=com, inertia=draw(POSITIVE))

    return LegDesign(
        name=draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=20)),
        trunk_mass=draw(POSITIVE),
        thigh=segment(l1),
        shank=segment(l1 + l3),
        foot=segment(l3),
        stiffness=(draw(POSITIVE), draw(POSITIVE)),
        damping=(draw(st.floats(0.0, 1.0)), draw(st.floats(0.0, 1.0))),
        limits=Limits(
            hip=(-draw(POSITIVE), draw(POSITIVE)),
            knee=(draw(st.floats(0.01, 1.0)), draw(st.floats(1.1, 3.1))),
        ),
    )


@BY_LAW
@given(design=designs())
def test_what_is_saved_is_loaded_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, design: LegDesign
) -> None:
    path = tmp_path_factory.getbasetemp() / "round trip.toml"
    save_design(design, path)
    assert load_design(path) == design
    assert design_from_mapping(design_to_mapping(design)) == design


def test_declared_units_are_read_exactly(tmp_path: Path) -> None:
    design = loaded(tmp_path, WHOLE)
    assert design.thigh == Segment(mass=0.207, length=0.064, com=0.010, inertia=0.000446)
    assert design.trunk_mass == 0.637
    assert design.limits.knee == pytest.approx((math.radians(17.2), math.radians(166.0)))
    assert design.damping == (0.0073, 0.0)
    assert design.total_mass == pytest.approx(1.0)


def test_the_papers_tables(table2: LegDesign, prototype: LegDesign) -> None:
    assert [segment.mass for segment in table2.segments] == [0.207, 0.126, 0.030]
    assert [segment.inertia for segment in table2.segments] == [446e-6, 140e-6, 70e-6]
    assert [segment.mass for segment in prototype.segments] == [0.192, 0.121, 0.030]
    assert table2.lengths == prototype.lengths == (0.064, 0.133, 0.069)
    for design in (table2, prototype):
        assert design.total_mass == pytest.approx(1.0)
        assert [segment.com for segment in design.segments] == [0.010, 0.067, 0.010]
    assert (table2.stiffness, prototype.stiffness) == ((3.124, 3.124), (2.3, 2.3))
    assert prototype.damping == (0.0092, 0.0073)


def test_the_optimal_leg_rounds_to_the_printed_table(optimal: LegDesign, table2: LegDesign) -> None:
    """The table gives whole grams, millimetres and kg mm^2."""
    for exact, printed in zip(optimal.segments, table2.segments, strict=True):
        for name, unit in (("mass", 1e-3), ("length", 1e-3), ("com", 1e-3), ("inertia", 1e-6)):
            rounded = round(getattr(exact, name) / unit)
            assert rounded == pytest.approx(getattr(printed, name) / unit), (exact, name)
    assert round(optimal.trunk_mass, 3) == table2.trunk_mass
    assert optimal.stiffness == table2.stiffness
    assert optimal.damping == table2.damping
    assert optimal.limits == table2.limits


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass = 207", "mass = -207", r"\[thigh\] mass is -0\.207 kg; it must be a positive"),
        ("mass = 207", "mass = 0", r"\[thigh\] mass is 0 kg"),
        ("mass = 207", "mass = nan", r"\[thigh\] mass is nan kg"),
        ("mass = 207", "mass = inf", r"\[thigh\] mass is inf kg"),
        ("mass = 207", "mass = 1" + "0" * 400, r"\[thigh\] 'mass' is too large for a number"),
        ("mass = 207", "mass = 1" + "0" * 5000, r"not valid TOML: .*4300 digits"),
        ("mass = 207", "mass = true", r"\[thigh\] 'mass' is True; it must be a number"),
        ("mass = 207", 'mass = "207"', r"\[thigh\] 'mass' is '207'; it must be a number"),
        ("mass = 207", "", r"\[thigh\] lacks 'mass' \(mass\)"),
        ("mass = 207", "mass = 207\nbeauty = 3", r"\[thigh\] has unknown keys: beauty"),
        ("length = 133", "length = 134", r"shank length is 0\.134 m but thigh \+ foot make 0\.133"),
        ("com = 67", "com = 140", r"\[shank\] com is 0\.14 m; it must lie on the segment"),
        ("com = 67", "com = nan", r"\[shank\] com is nan m"),
        ("[3.124, 3.124]", "[3.124]", r"\[springs\] needs 'stiffness' = \[a, b\], not \[3\.124\]"),
        ("[3.124, 3.124]", "[3.124, -1]", r"stiffness of spring 2 is -1 N m/rad"),
        ("[0.0073, 0.0]", "[0.0073, -0.1]", r"damping of joint 2 is -0\.1 N m s/rad"),
        ("[0.0073, 0.0]", "[nan, 0.1]", r"damping of joint 1 is nan"),
        ("[17.2, 166.0]", "[166.0, 17.2]", r"knee range is .* rad; low must be below high"),
        ("[17.2, 166.0]", "[0.0, 166.0]", r"knee range is .* singular at 0 and pi: keep it"),
        ("[17.2, 166.0]", "[17.2, 180.0]", r"singular at 0 and pi"),
        ("[-126.0, 51.5]", "[-126.0, nan]", r"hip range is .* rad; low must be below high"),
        ('mass = "g"', 'mass = "lb"', r"\[units\] mass is 'lb'; known are 'kg', 'g'"),
        ('mass = "g"', "mass = 5", r"\[units\] mass is '5'; known are"),
        ('mass = "g"', 'mass = ["g"]', r"\[units\] mass is '\['g'\]'; known are"),
        ('mass = "g"', 'beauty = "g"', r"\[units\] knows no 'beauty'; it knows mass, length"),
        ("[limits]", "[bounds]", r"unknown entries: bounds"),
        ("[trunk]\nmass = 637", "", r"\[trunk\] is missing; a design has trunk, thigh"),
        ("[trunk]", "[[trunk]]", r"\[trunk\] must be a table, not \[\{'mass': 637\}\]"),
        ("[trunk]\nmass = 637", "\n", r"\[trunk\] is missing"),
        ("[thigh]", "[thigh", r"not valid TOML: .*line"),
        ('name = "a leg"', 'units = 5\nname = "a leg"', r"not valid TOML"),
    ],
)
def test_a_bad_file_is_told_by_path_and_reason(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    assert WHOLE.count(old) >= 1
    with pytest.raises(DesignError, match=rf"(?s)^{tmp_path}/leg\.toml: .*{message}"):
        loaded(tmp_path, WHOLE.replace(old, new, 1))


def test_units_that_are_no_table() -> None:
    with pytest.raises(DesignError, match=r"\[units\] must be a table, not 5"):
        design_from_mapping({"units": 5})


def test_files_that_are_not_there_or_no_text(tmp_path: Path) -> None:
    told = r"nowhere\.toml: no such design file; .*optimal, prototype"
    with pytest.raises(DesignError, match=told):
        load_design(tmp_path / "nowhere.toml")
    with pytest.raises(DesignError, match="cannot be read: "):
        load_design(tmp_path)
    (tmp_path / "noise.toml").write_bytes(bytes(range(128, 256)))
    with pytest.raises(DesignError, match="cannot be read: "):
        load_design(tmp_path / "noise.toml")
    (tmp_path / "empty.toml").write_bytes(b"")
    with pytest.raises(DesignError, match="is empty; write it anew"):
        load_design(tmp_path / "empty.toml")


def test_lengths_may_differ_by_rounding_alone(optimal: LegDesign) -> None:
    shank = optimal.shank
    replace(optimal, shank=replace(shank, length=shank.length + 0.9e-9))
    with pytest.raises(DesignError, match="needs l2 = l1 \\+ l3"):
        replace(optimal, shank=replace(shank, length=shank.length + 1.1e-9))
