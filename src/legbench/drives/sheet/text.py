"""Bytes of an electronic data sheet to clean sections, whatever its maker's tool made of it; pure.

Vendors' files differ in encoding, line ends, case, number formats and in what they leave out (CiA
306-1 gives one spelling). What is read here has one spelling again, and a bounded size.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from legbench.reading import UnreadableError

LARGEST_EDS = 1 << 22
"""Largest data sheet [bytes]; those of drives have 40 000 to a million."""
MOST_SECTIONS, MOST_KEYS, LONGEST_VALUE = 16_384, 512, 4096
"""Largest number of sections, of keys in one, and of characters in a value."""
Section = dict[str, str]
_OBJECT = re.compile(r"(?:0x)?([0-9a-f]{1,4})(?:\s*sub\s*(?:0x)?([0-9a-f]{1,2}))?", re.IGNORECASE)
_LIST = re.compile(r"(?:0x)?([0-9a-f]{1,4})\s*(name|value|denotation)", re.IGNORECASE)
_HEADER = re.compile(r"\[\s*([^\]]*?)\s*\]")
_NUMBER = re.compile(r"([+-]?)(0x[0-9a-f]+|[0-9a-f]+h|[0-9]+)", re.IGNORECASE)
_LONGEST_NUMBER = 40
_COMMENT = re.compile(r";|#|//")


@dataclass(slots=True)
class Sections:
    """Sections of a data sheet, their keys in lower case."""

    objects: dict[tuple[int, int | None], Section] = field(default_factory=dict)
    """Sections by index and sub-index; the sub-index is none for an object itself."""
    lists: dict[tuple[int, str], Section] = field(default_factory=dict)
    """Sections of a compact array by index and kind: name, value or denotation."""
    others: dict[str, Section] = field(default_factory=dict)
    """Other sections by their name in lower case."""
    remarks: list[str] = field(default_factory=list)


def decode(content: bytes) -> str:
    """Return the text of a data sheet: UTF-16 or UTF-8, with a mark or without, else Latin-1.

    Raises:
        UnreadableError: it is no text, or XML.
    """
    try:
        if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
            text = content.decode("utf-16")
        elif b"\0" in content[:2]:
            text = content.decode("utf-16-be" if content[:1] == b"\0" else "utf-16-le")
        else:
            text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    if "\0" in text:
        raise UnreadableError("is no text: it holds zero bytes; is it a data sheet?")
    if text.lstrip().startswith("<"):
        raise UnreadableError(
            "is XML, as XDD, XDC and ESI files are; ask the maker for the EDS of the drive's CAN "
            "version"
        )
    return text


def split(text: str) -> Sections:
    """Return the sections of a data sheet; what is no section and no entry is passed over.

    Raises:
        UnreadableError: it has no section, or more or longer ones than a data sheet has.
    """
    found = Sections()
    current: Section | None = None
    count = double = 0
    for raw in re.split(r"\r\n|\n|\r", text):
        line = raw.strip()
        if not line or line[0] in ";#":
            continue
        header = _HEADER.match(line)
        if header is not None:
            count += 1
            if count > MOST_SECTIONS:
                raise UnreadableError(f"has more than {MOST_SECTIONS} sections, the limit")
            current, again = _place(found, header[1])
            double += again
        elif current is not None and "=" in line:
            name, _, value = line.partition("=")
            current.setdefault(name.strip().lower(), value.strip()[:LONGEST_VALUE])
            if len(current) > MOST_KEYS:
                raise UnreadableError(f"has a section of more than {MOST_KEYS} keys, the limit")
    if not count:
        raise UnreadableError("has no section such as [DeviceInfo]; is it a data sheet?")
    if double:
        found.remarks.append(f"{double} sections stand twice; the first of each counts")
    return found


def _place(found: Sections, name: str) -> tuple[Section, bool]:
    """Return the section of a name, and whether it has been there before."""
    known = _OBJECT.fullmatch(name)
    if known is not None:
        key = (int(known[1], 16), None if known[2] is None else int(known[2], 16))
        section = found.objects.get(key)
        if section is not None:
            return {}, True
        return found.objects.setdefault(key, {}), False
    listed = _LIST.fullmatch(name)
    if listed is not None:
        return found.lists.setdefault((int(listed[1], 16), listed[2].lower()), {}), False
    return found.others.setdefault(name.lower(), {}), False


def bare(text: str) -> str:
    """Return a value without a comment after it."""
    return _COMMENT.split(text)[0].strip()


def number(text: str | None) -> int | None:
    """Return a number as data sheets write it, hexadecimal in any case; none if it is none.

    Decimal numbers may have leading zeros, hexadecimal ones may end with an h. A comment after it
    is passed over.
    """
    word = bare(text or "").strip('"')
    found = _NUMBER.fullmatch(word) if len(word) <= _LONGEST_NUMBER else None
    if found is None:
        return None
    sign, digits = -1 if found[1] == "-" else 1, found[2].lower()
    if digits.startswith("0x"):
        return sign * int(digits, 16)
    return sign * (int(digits[:-1], 16) if digits.endswith("h") else int(digits))


def node_number(text: str | None) -> tuple[int, bool] | None:
    """Return a number that may be added to $NODEID, and whether it is; none if it is none."""
    word = re.sub(r"\s", "", bare(text or "")).upper()
    if "$NODEID" not in word:
        plain = number(word)
        return None if plain is None else (plain, False)
    rest = word.replace("$NODEID", "", 1).strip("+")
    plain = number(rest) if rest else 0
    return None if plain is None else (plain, True)


def words(section: Mapping[str, str], key: str) -> str:
    """Return a text of a section, without what no terminal shows; empty if it is not there."""
    return "".join(c for c in section.get(key, "") if c.isprintable())[:80]
