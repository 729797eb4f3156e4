"""MuJoCo model of a design; the only writer of MJCF."""

from legbench.mjcf.build import BuildOptions, build_spec
from legbench.mjcf.ground import Ground
from legbench.mjcf.linkage import Linkage, LinkageKind
from legbench.mjcf.numerics import Numerics
from legbench.mjcf.pose import rest_qpos
from legbench.mjcf.xml import to_xml, xml_hash

__all__ = [
    "BuildOptions",
    "Ground",
    "Linkage",
    "LinkageKind",
    "Numerics",
    "build_spec",
    "rest_qpos",
    "to_xml",
    "xml_hash",
]
