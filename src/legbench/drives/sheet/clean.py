"""Sections of a data sheet to a text in the one spelling of CiA 306-1, compact arrays written out.

The library that reads data sheets takes that spelling alone, and stops at the first key that is not
there. What is left out here, or guessed, is remarked.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Iterator

from legbench.drives.protocol.objects import OBJECTS, Key
from legbench.drives.setup.needs import MAPPINGS
from legbench.drives.sheet.plausible import OUR_OWN
from legbench.drives.sheet.text import Section, Sections, bare, node_number, number, words
from legbench.reading import UnreadableError

RECORD = 0x9
LAST_BASIC_TYPE = 0x1B
"""Last data type of CiA 301's table; a later one is a maker's own, which an object defines."""
TEXTS = (0x09, 0x0A, 0x0B, 0x0F)
"""Types whose default is a text or bytes: visible and octet string, Unicode, domain."""
REALS = (0x08, 0x11)
ACCESS = ("ro", "wo", "rw", "rwr", "rww", "const")
ALIASES = {"r": "ro", "readonly": "ro", "w": "wo", "writeonly": "wo", "readwrite": "rw"}
ALIASES["constant"] = "const"
"""Access types in the words of makers, without what is no letter."""
MOST_SUBS = 254
MOST_OBJECTS = 16_384
"""Largest number of objects, those of compact arrays included."""
COUNT: Section = {"parametername": "count", "datatype": "5", "accesstype": "ro"}


def clean_text(found: Sections) -> str:
    """Return the text of all objects; what is left out is added to the remarks of `found`.

    Raises:
        UnreadableError: compact arrays make more objects than a device has.
    """
    grouped: dict[int, dict[int | None, Section]] = defaultdict(dict)
    for (index, sub), section in found.objects.items():
        grouped[index][sub] = section
    remarks: Counter[str] = Counter()
    # Without this section canopen warns.
    lines = ["[DeviceInfo]"]
    total = 0
    for index, group in sorted(grouped.items()):
        head = group.pop(None, {})
        subs = {sub: section for sub, section in group.items() if sub is not None}
        count = min(number(head.get("compactsubobj")) or 0, MOST_SUBS)
        if count > 0:
            subs = _expanded(found, index, head, count) | subs
        total += max(1, len(subs))
        if total > MOST_OBJECTS:
            raise UnreadableError(f"describes more than {MOST_OBJECTS} objects, the limit")
        if not subs:
            lines += _variable(f"{index:04X}", (index, 0), head, found, remarks)
            continue
        subs = _numbered(index, subs, remarks)
        members = [
            line
            for sub, section in sorted(subs.items())
            for line in _variable(f"{index:04X}sub{sub:X}", (index, sub), section, found, remarks)
        ]
        name = words(head, "parametername") or f"object {index:04X}h"
        lines += [f"[{index:04X}]", f"ParameterName={name}", f"ObjectType=0x{RECORD:X}", *members]
    found.remarks += [f"{count} objects {what}" for what, count in sorted((+remarks).items())]
    return "\n".join(lines) + "\n"


def _expanded(found: Sections, index: int, head: Section, count: int) -> dict[int, Section]:
    """Return the sub-objects of a compact array (CiA 306-1, 4.6.3.3), names and values included."""
    names = found.lists.get((index, "name"), {})
    values = found.lists.get((index, "value"), {})
    title = words(head, "parametername")
    subs = {0: COUNT | {"defaultvalue": str(count)}}
    for sub in range(1, count + 1):
        own = {"parametername": names.get(str(sub)) or f"{title} {sub}"}
        if str(sub) in values:
            own["parametervalue"] = values[str(sub)]
        subs[sub] = head | own
    return subs


def _numbered(index: int, subs: dict[int, Section], remarks: Counter[str]) -> dict[int, Section]:
    """Return the sub-objects with the sub-index 0 that every array and record has (CiA 301, 7.4.7).

    That of a mapping counts what is mapped, and is written where its entries are.
    """
    if 0 in subs:
        return subs
    remarks["without their sub-index 0 have got one"] += 1
    counted = max(subs)
    own = dict[str, str]()
    if any(index in mapping for mapping in MAPPINGS):
        mapped = [sub for sub, section in subs.items() if number(_told(section))]
        counted = max(mapped, default=0)
        own["accesstype"] = words(subs[min(subs)], "accesstype")
    return {0: COUNT | {"defaultvalue": str(counted)} | own} | subs


def _told(section: Section) -> str:
    """Value at power-on: that of a configured device (DCF), else the default."""
    return section.get("parametervalue") or section.get("defaultvalue", "")


def _variable(
    where: str, key: Key, section: Section, found: Sections, remarks: Counter[str]
) -> Iterator[str]:
    """Yield the lines of one object; none where its type is not told."""
    kind = _type(section, found)
    if kind is None:
        remarks["without a data type were left out"] += 1
        return
    access = _access(words(section, "accesstype"))
    if access is None:
        remarks["without a known access type have the profile's, else can be written"] += 1
        known = OBJECTS.get(key) if key[0] not in OUR_OWN else None
        access = "rw" if known is None else known.access.value
    yield f"[{where}]"
    yield f"ParameterName={words(section, 'parametername') or 'object'}"
    yield "ObjectType=0x7"
    yield f"DataType=0x{kind:04X}"
    yield f"AccessType={access}"
    mappable = number(section.get("pdomapping"))
    if mappable is None:
        mappable = key[0] not in OUR_OWN and key in OBJECTS and OBJECTS[key].mappable
        remarks["do not say whether they can be mapped; the profile's can"] += mappable
    yield f"PDOMapping={int(bool(mappable))}"
    text = _told(section)
    if text:
        value = _value(kind, text)
        if value is None:
            remarks["have a default that is no value; it was left out"] += 1
        else:
            yield f"DefaultValue={value}"
    for name, word in (("lowlimit", "LowLimit"), ("highlimit", "HighLimit")):
        limit = number(section.get(name))
        if limit is not None and kind not in (*TEXTS, *REALS):
            yield f"{word}={limit}"


def _access(text: str) -> str | None:
    """Return an access type in the spelling of CiA 306; none if it is none."""
    letters = re.sub(r"[^a-z]", "", bare(text).lower())
    access = ALIASES.get(letters, letters)
    return access if access in ACCESS else None


def _type(section: Section, found: Sections) -> int | None:
    """Return the number of a basic data type; a maker's own one is looked up where it is defined.

    The object of such a type holds the number of the basic one in its sub-index 1.
    """
    kind = number(section.get("datatype"))
    if kind is not None and kind > LAST_BASIC_TYPE:
        kind = number(found.objects.get((kind, 1), {}).get("defaultvalue"))
    return kind if kind is not None and 0 < kind <= LAST_BASIC_TYPE else None


def _value(kind: int, text: str) -> str | None:
    if kind in TEXTS:
        return text.partition(";")[0].strip()
    if kind in REALS:
        try:
            return repr(float(bare(text)))
        except ValueError:
            return None
    found = node_number(text)
    if found is None:
        return None
    value, relative = found
    return f"$NODEID+0x{value:X}" if relative and value >= 0 else str(value)
