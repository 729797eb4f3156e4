"""What reads, parses and compares the documents notices what is wrong in them."""

from pathlib import Path

import pytest
from docs_blocks import (
    CommandLine,
    NamedFile,
    Program,
    items,
    spans,
)
from docs_compare import differences
from docs_parse import misunderstood, unknown_flags

PAGE = """# A page

```
$ legbench check leg.toml   # judged
inertia    met  +3.714e-10

elastic    met
$ legbench hop leg.toml
```

Then `legbench run jump --duration 2` again:

```
more="--view --speed 0.5"
legbench replay RUN $more # watch
sudo ip link set can0 up
```

```python
# mine.py
x = 1
```

```python
print(2)
```
"""


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setattr("docs_blocks.ROOT", tmp_path)
    path = tmp_path / "page.md"
    path.write_text(PAGE, encoding="utf-8")
    return path


def test_commands_files_and_programs_are_found_with_their_places(page: Path) -> None:
    check, hop, replay, mine, program = items(page)
    assert check == CommandLine(
        place="page.md:4",
        words=("legbench", "check", "leg.toml"),
        prompted=True,
        shown=("inertia    met  +3.714e-10", "", "elastic    met"),
    )
    assert isinstance(hop, CommandLine)
    assert isinstance(replay, CommandLine)
    assert (hop.words, hop.prompted, hop.shown) == (("legbench", "hop", "leg.toml"), True, ())
    assert (replay.words, replay.prompted) == (
        ("legbench", "replay", "RUN", *["--view", "--speed", "0.5"]),
        False,
    )
    assert isinstance(mine, NamedFile)
    assert (mine.name, mine.text) == ("mine.py", "# mine.py\nx = 1\n")
    assert isinstance(program, Program)
    assert program.text == "print(2)\n"
    assert list(spans(page)) == [("page.md:11", ["legbench", "run", "jump", "--duration", "2"])]


def test_a_block_without_an_end_is_refused(page: Path) -> None:
    page.write_text("```\nlegbench check leg.toml\n", encoding="utf-8")
    with pytest.raises(ValueError, match="the block at line 2 has no end"):
        list(items(page))


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        ("hopping  2.17 Hz", "hopping 2.167 Hz"),
        ("drift  5.30 mm", "drift  5.309 mm"),
        ("P^r 0.99 lowest, 4 jumps", "P^r 0.9984 lowest, 4 jumps"),
        ("link -0.0000 rad", "link +0.0000 rad"),
        ("residual 4.3e-05 of it", "residual 4.318e-05 of it"),
        ("run  runs/TIME_jump-optimal", "run  runs/20261127-034430_jump-optimal"),
        ("run  runs/TIME_jump-optimal", "run  runs/20261127-034430-2_jump-optimal"),
        ("legbench: the limits changed ...", "legbench: the limits changed the command"),
        ("SYNC 080h  55 bits", "SYNC 080h  55 bits"),
    ],
)
def test_lines_that_agree(shown: str, printed: str) -> None:
    assert differences([shown], [printed]) == []


@pytest.mark.parametrize(
    ("shown", "printed"),
    [
        ("hopping  2.17 Hz", "hopping 2.151 Hz"),
        ("5 jumps", "4 jumps"),
        ("SYNC 080h", "SYNC 081h"),
        ("motor1 stands", "motor2 stands"),
        ("link -0.3000 rad", "link +0.3000 rad"),
        ("met", "VIOLATED"),
        ("P^r 0.99", "P^r nan"),
    ],
)
def test_lines_that_differ(shown: str, printed: str) -> None:
    assert differences([shown], [printed]) == [f"shown:   {shown}", f"printed: {printed}"]


def test_a_line_of_dots_stands_for_lines_and_wall_time_for_nothing() -> None:
    printed = ["first", "second", "speed             1.7 x real time", "last"]
    assert differences(["first", "...", "last"], printed) == []
    assert differences(["first", "..."], printed) == []
    assert differences(["first", "second"], printed) == ["printed, and not shown: last"]
    assert differences(["...", "next"], printed) == ["shown:   next", "printed: nothing more"]


def test_a_command_that_is_none_is_noticed(desk: Path) -> None:
    for words, told in (
        (("legbench", "jmup"), "no command 'jmup'"),
        (("legbench", "replay"), "required"),
        (("legbench", "run", "jump", "--durations", "2"), "--durations"),
        (("legbench", "drives", "scann"), "scann"),
        (("legbench", "hop", "leg.toml", "--basin", "9"), "needs --out"),
        (("make", "jumps"), "make has no ['jumps']"),
        (("python", "scripts/none.py"), "there is no scripts/none.py"),
    ):
        assert told in (misunderstood(words, desk) or ""), words
    assert misunderstood(("legbench", "run", "jump", "--duration", "2"), desk) is None
    assert unknown_flags(("legbench", "run", "...", "--durations", "2"), desk) == ["--durations"]
    assert unknown_flags(("legbench", "drives", "jog", "--by"), desk) == []
    assert unknown_flags(("legbench", "drives", "jogg"), desk) == ["jogg"]
