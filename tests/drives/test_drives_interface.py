"""SocketCAN interfaces, as the kernel and `ip` describe them."""

import json
import subprocess
from pathlib import Path
from types import SimpleNamespace

import pytest
from drives_rig import config

from legbench.drives.errors import BusError
from legbench.drives.transport import interface as interface_module
from legbench.drives.transport import open_bus
from legbench.drives.transport.interface import ask_ip, bitrate_of, check_interface
from legbench.drives.transport.open_bus import Adapter

UP, DOWN = "0x40081", "0x40080"


def described(bitrate: int | None) -> str:
    """As `ip -json -details link show can0` prints it, shortened."""
    timing = {} if bitrate is None else {"bittiming": {"bitrate": bitrate, "sample_point": "0.750"}}
    can = {"info_kind": "can", "info_data": {"state": "ERROR-ACTIVE", "restart_ms": 100, **timing}}
    return json.dumps([{"ifname": "can0", "txqlen": 32, "linkinfo": can}])


def interface(folder: Path, flags: str) -> Path:
    (folder / "can0").mkdir()
    (folder / "can0" / "flags").write_text(flags + "\n", encoding="ascii")
    return folder


def test_an_interface_that_is_down_is_named_with_the_way_out(tmp_path: Path) -> None:
    words = r"can0 is down; bring it up: `ip link set can0 up type can bitrate 1000000 restart-ms"
    with pytest.raises(BusError, match=words):
        check_interface(config(), "can0", interface(tmp_path, DOWN), lambda _: described(None))


def test_a_virtual_one_is_brought_up_without_a_bitrate(tmp_path: Path) -> None:
    text = json.dumps([{"ifname": "can0", "linkinfo": {"info_kind": "vcan"}}])
    with pytest.raises(BusError, match=r"can0 is down; bring it up: `ip link set can0 up`$"):
        check_interface(config(), "can0", interface(tmp_path, DOWN), lambda _: text)


def test_an_interface_at_another_bitrate_is_named_with_both(tmp_path: Path) -> None:
    system = interface(tmp_path, UP)
    check_interface(config(), "can0", system, lambda _: described(1_000_000))
    with pytest.raises(BusError, match=r"can0 runs at 500000 bit/s, but the bus file says 1000000"):
        check_interface(config(), "can0", system, lambda _: described(500_000))
    with pytest.raises(BusError, match=r"500000 bit/s is asked for, but the bus file says 1000000"):
        check_interface(config().at(500_000), "can0", system, lambda _: described(1_000_000))


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", "[1]", '[{"linkinfo": null}]'])
def test_what_has_no_bitrate_passes(text: str, tmp_path: Path) -> None:
    assert bitrate_of(text) is None
    check_interface(config(), "can0", interface(tmp_path, UP), lambda _: text)
    check_interface(config(), "none0", tmp_path, lambda _: pytest.fail("asked for nothing"))


def test_the_real_tools_of_this_machine_are_asked_and_may_be_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert bitrate_of(ask_ip("lo")) is None
    monkeypatch.setenv("PATH", "")
    assert ask_ip("lo") == ""


def test_an_interface_of_which_nothing_is_told_is_brought_up_with_a_bitrate(tmp_path: Path) -> None:
    system = interface(tmp_path, DOWN)
    for text in ("", "{", "[]", '[{"linkinfo": null}]'):
        words = "ip link set can0 up type can bitrate 1000000 restart-ms 100`$"
        with pytest.raises(BusError, match=words):
            check_interface(config(), "can0", system, lambda _, text=text: text)


@pytest.mark.parametrize("failure", [None, OSError(), subprocess.TimeoutExpired("ip", 5.0)])
def test_the_tool_is_asked_once_and_waited_for_5_s(
    failure: Exception | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[tuple[str, ...], dict[str, object]]] = []

    def answer(command: tuple[str, ...], **how: object) -> SimpleNamespace:
        asked.append((command, how))
        if failure is not None:
            raise failure
        return SimpleNamespace(stdout="told", returncode=1)

    monkeypatch.setattr(interface_module.subprocess, "run", answer)
    assert ask_ip("can0") == ("told" if failure is None else "")
    how = {"capture_output": True, "text": True, "timeout": 5.0, "check": False}
    assert asked == [(("ip", "-json", "-details", "link", "show", "can0"), how)]


def test_it_is_looked_at_before_it_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    def down(_config: object, channel: str) -> None:
        raise BusError(f"{channel} is down")

    monkeypatch.setattr(open_bus, "check_interface", down)
    with pytest.raises(BusError, match="can0 is down"):
        open_bus.open_bus(config(), Adapter(interface="socketcan", channel="can0"))
