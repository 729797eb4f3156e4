"""The model as text that loses nothing: what is saved is what is run.

MuJoCo's own writer rounds to six digits and leaves out everything that equals a default. Here
the numbers that carry physics are written again in full, and solver and cone are named.
"""

import hashlib
import xml.etree.ElementTree as ET
from collections.abc import Iterable

import mujoco
import numpy as np

EXACT: dict[str, dict[str, str]] = {
    "inertial": {"pos": "ipos", "mass": "mass", "diaginertia": "inertia"},
    "body": {"pos": "pos"},
    "joint": {
        "range": "range",
        "damping": "damping",
        "pos": "pos",
        "solreflimit": "solref_limit",
        "solimplimit": "solimp_limit",
        "frictionloss": "frictionloss",
        "solreffriction": "solref_friction",
        "solimpfriction": "solimp_friction",
    },
    "site": {"pos": "pos"},
    "geom": {"pos": "pos", "size": "size"},
    "fixed": {
        "damping": "damping",
        "frictionloss": "frictionloss",
        "solreffriction": "solref_friction",
        "solimpfriction": "solimp_friction",
    },
    "connect": {"solref": "solref", "solimp": "solimp"},
    "pair": {"solref": "solref", "solimp": "solimp", "friction": "friction"},
    "general": {"gainprm": "gainprm", "biasprm": "biasprm"},
    "key": {"qpos": "qpos", "ctrl": "ctrl"},
}
"""XML tag -> attribute -> the field of MjSpec's object that holds its exact value."""


def to_xml(spec: mujoco.MjSpec) -> str:
    """MJCF text of a compiled spec, exact to the last bit."""
    root = ET.fromstring(spec.to_xml())
    option = _child(root, "option")
    option.set("solver", "Newton")
    option.set("cone", "elliptic")
    option.set("integrator", "RK4")
    objects = _objects(spec)
    for body in root.iter("body"):
        for inertial in body.findall("inertial"):
            _write(inertial, objects["body", body.get("name", "")])
    for tag in EXACT.keys() - {"inertial"}:
        for element in root.iter(tag):
            held = objects.get((tag, element.get("name", "")))
            if held is not None:
                _write(element, held)
    for joint in root.iterfind("./equality/joint"):
        _write_fields(joint, objects["equality", joint.get("name", "")], EXACT["connect"])
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def xml_hash(xml: str) -> str:
    """SHA-256 of a model's XML, as a run's manifest keeps it."""
    return hashlib.sha256(xml.encode()).hexdigest()


def _child(root: ET.Element, tag: str) -> ET.Element:
    found = root.find(tag)
    return ET.SubElement(root, tag) if found is None else found


def _objects(spec: mujoco.MjSpec) -> dict[tuple[str, str], object]:
    """Objects by tag and name; geoms given by their two ends are looks alone and left out."""
    lists: dict[str, Iterable[object]] = {
        "body": spec.bodies,
        "joint": spec.joints,
        "site": spec.sites,
        "geom": [geom for geom in spec.geoms if np.isnan(geom.fromto[0])],
        "fixed": spec.tendons,
        "connect": spec.equalities,
        "equality": spec.equalities,
        "pair": spec.pairs,
        "general": spec.actuators,
        "key": spec.keys,
    }
    # pyrefly: ignore[missing-attribute]
    return {(tag, item.name): item for tag, items in lists.items() for item in items}


def _write(element: ET.Element, held: object) -> None:
    _write_fields(element, held, EXACT[element.tag])


def _write_fields(element: ET.Element, held: object, fields: dict[str, str]) -> None:
    """Replace the attributes that are there; constraint settings are written in any case."""
    for attribute, field in fields.items():
        always = attribute in ("solref", "solimp")
        always |= attribute in ("solreflimit", "solimplimit") and "range" in element.attrib
        always |= attribute.endswith("friction") and "frictionloss" in element.attrib
        if not always and attribute not in element.attrib:
            continue
        value = getattr(held, field)
        numbers = [float(value)] if isinstance(value, int | float) else [float(x) for x in value]
        if not always:
            numbers = numbers[: len(element.attrib[attribute].split())]
        element.set(attribute, " ".join(_number(number) for number in numbers))


def _number(value: float) -> str:
    """The shortest text that reads back as the same number."""
    return repr(int(value)) if value == int(value) else repr(value)
