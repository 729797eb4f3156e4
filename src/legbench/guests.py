"""Registries of classes that are built in, installed beside legbench, or in a user's file.

A class is named by one text: the kind of a built-in or an entry point, `package.module:Class`,
or `path/to/mine.py:Class`. It is loaded when it is asked for, so that a guest that does not
import, or drags in half a day of imports, harms nobody else.
"""

import importlib
import importlib.util
import sys
import traceback
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, Final

from legbench.errors import ConfigError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GUEST_PREFIX: Final = "legbench_guest_"
"""Beginning of the module names of files; a hash follows, so that two `mine.py` coexist."""
WHERE: Final = MappingProxyType({"where": True})
"""Metadata of a field that says where something is, not what: it stays out of an experiment's
canonical text."""


class GuestError(ConfigError):
    """Error of a guest that does not import; the message ends with its own traceback."""


def load_text(text: str) -> Any:
    """Return what `package.module:name` stands for; imports the module.

    Raises:
        ImportError, AttributeError: it is not there.
    """
    module, _, name = text.partition(":")
    return getattr(importlib.import_module(module), name)


def entry_points(group: str) -> "Iterable[EntryPoint]":
    """Entry points of a group in installed packages; only this needs `importlib.metadata`."""
    return load_text("importlib.metadata:entry_points")(group=group)


@dataclass(frozen=True, slots=True, kw_only=True)
class Registry:
    """Registry of one sort of class, with the ways in which one is found."""

    what: str
    """Sort of the classes in words, such as `controller`."""
    builtin: Mapping[str, str]
    """Place of each built-in kind as `package.module:Class`."""
    group: str
    """Entry-point group of installed packages."""
    members: Mapping[str, str]
    """Name of what a class must have besides `kind` -> how it is written."""

    def find(self, name: str) -> type[Any]:
        """Return the class that a text names.

        Raises:
            GuestError: its file or package does not import.
            ConfigError: there is no such class, it lacks something, or takes a built-in's name.
        """
        if name in self.builtin:
            return load_text(self.builtin[name])
        if ":" in name or name.endswith(".py"):
            return self._checked(self._from_text(name), name)
        found = self._entry_points().get(name)
        if found is None:
            raise ConfigError(
                f"no {self.what} '{name}'; there are {', '.join(self.names())}, or a class of your "
                "own as path/to/mine.py:Class"
            )
        try:
            guest = found.load()
        except Exception as error:  # whatever a package of somebody else does when it is imported
            what = f"{self.what} '{name}' ({found.value})"
            raise GuestError(_import_failed(what, error)) from error
        return self._checked(guest, name)

    def names(self) -> tuple[str, ...]:
        """Names of the kinds that are built in or installed, none of which is loaded."""
        return (*self.builtin, *(name for name in self._entry_points() if name not in self.builtin))

    def reference(self, guest: type[Any]) -> str:
        """Return the text that finds this class again, in another process, too.

        Raises:
            ConfigError: it was written in a notebook or a prompt, where no other process looks.
        """
        kind = str(guest.kind)
        if self.builtin.get(kind) == f"{guest.__module__}:{guest.__qualname__}":
            return kind
        if not _lives_in_file(guest):
            return f"{guest.__module__}:{guest.__qualname__}"
        path = source_of(guest)
        if path is None:
            raise ConfigError(
                f"{self.what} '{kind}' has no file that another process could find; write "
                f"{guest.__qualname__} into a file of its own and import it from there"
            )
        return f"{path}:{guest.__qualname__}"

    def check(self, guest: type[Any]) -> None:
        """Refuse a class that takes a built-in's name; raises ConfigError."""
        self._checked(guest, guest.__qualname__)

    def _entry_points(self) -> "dict[str, EntryPoint]":
        return {entry.name: entry for entry in entry_points(self.group)}

    def _from_text(self, text: str) -> Any:
        place, _, name = text.rpartition(":") if ":" in text else (text, "", "")
        if not place.endswith(".py"):
            try:
                return load_text(text)
            except Exception as error:  # as above
                raise GuestError(_import_failed(f"{self.what} '{text}'", error)) from error
        module = module_of_file(Path(place))
        if not name or name not in vars(module):
            kinds = [key for key, value in vars(module).items() if self._looks_like(value, module)]
            known = f"it has {', '.join(kinds)}" if kinds else f"it has no {self.what}"
            wanted = f"has no class '{name}'" if name else f"needs a class, as {place}:Class"
            raise ConfigError(f"{place} {wanted}; {known}")
        return getattr(module, name)

    def _looks_like(self, value: object, module: ModuleType) -> bool:
        return (
            isinstance(value, type)
            and value.__module__ == module.__name__
            and isinstance(getattr(value, "kind", None), str)
        )

    def _checked(self, guest: Any, name: str) -> type[Any]:
        if not isinstance(guest, type):
            raise ConfigError(f"{name} is no {self.what}: it is {type(guest).__name__}, no class")
        missing = [text for member, text in self.members.items() if not _has(guest, member)]
        kind = getattr(guest, "kind", None)
        if not isinstance(kind, str):
            missing.insert(0, "kind: ClassVar[str]")
        if not is_dataclass(guest):
            missing.insert(0, "@dataclass(frozen=True, kw_only=True)")
        if missing:
            raise ConfigError(f"{name} is no {self.what}: it lacks {', '.join(missing)}")
        taken = self.builtin.get(str(kind))
        if taken is not None and taken != f"{guest.__module__}:{guest.__qualname__}":
            raise ConfigError(
                f"{name} calls itself '{kind}', which is built in; give it a kind of its own"
            )
        return guest


def _has(guest: type[Any], member: str) -> bool:
    return getattr(guest, member, None) is not None


def _lives_in_file(guest: type[Any]) -> bool:
    """Whether the class belongs to a file rather than to an importable module."""
    module = guest.__module__
    return module == "__main__" or module.startswith(GUEST_PREFIX)


def source_of(guest: type[Any]) -> Path | None:
    """Return the file that a class was written in, if there is one."""
    file = getattr(sys.modules.get(guest.__module__), "__file__", None)
    path = None if file is None else Path(file)
    return path if path is not None and path.is_file() else None


def module_of_file(path: Path) -> ModuleType:
    """The module in a file, loaded under a name that no other file has.

    Raises:
        ConfigError: there is no such file.
        GuestError: it does not import.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None
    digest = load_text("hashlib:sha256")(str(path.resolve()).encode() + b"\0" + content).hexdigest()
    name = f"{GUEST_PREFIX}{path.stem}_{digest[:12]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ConfigError(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever the file of somebody else does when it is imported
        del sys.modules[name]
        raise GuestError(_import_failed(str(path), error, path)) from error
    return module


def _import_failed(what: str, error: Exception, path: Path | None = None) -> str:
    return f"{what} does not import:\n{guest_traceback(error, path)}"


def guest_traceback(error: BaseException, path: Path | None = None) -> str:
    """Traceback of an error from the first line of the file `path` on, without our own frames."""
    frames = traceback.extract_tb(error.__traceback__)
    if path is not None:
        files = [Path(frame.filename).resolve() for frame in frames]
        here = path.resolve()
        frames = frames[files.index(here) :] if here in files else []
    else:
        frames = [frame for frame in frames if not _ours(frame.filename)]
    lines = [*traceback.format_list(frames), *traceback.format_exception_only(error)]
    return "".join(lines).rstrip("\n")


def _ours(filename: str) -> bool:
    return filename.startswith(("<frozen", str(Path(__file__).parent))) or (
        "importlib" in Path(filename).parts
    )
