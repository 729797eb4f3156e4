"""MuJoCo model of a design; the only writer of MJCF.

What imports MuJoCo is loaded when it is asked for: choosing a model costs nothing.
"""

from typing import TYPE_CHECKING

from legbench.lazily import lazy_names
from legbench.mjcf.options import BuildOptions, Ground, Linkage, LinkageKind, Numerics

if TYPE_CHECKING:
    from legbench.mjcf.build import bare_model, build_spec
    from legbench.mjcf.pose import rest_qpos
    from legbench.mjcf.text import model_text
    from legbench.mjcf.xml import to_xml, xml_hash

__all__ = [
    "BuildOptions",
    "Ground",
    "Linkage",
    "LinkageKind",
    "Numerics",
    "bare_model",
    "build_spec",
    "model_text",
    "rest_qpos",
    "to_xml",
    "xml_hash",
]
__getattr__ = lazy_names(
    __name__,
    {
        "bare_model": "legbench.mjcf.build",
        "build_spec": "legbench.mjcf.build",
        "model_text": "legbench.mjcf.text",
        "rest_qpos": "legbench.mjcf.pose",
        "to_xml": "legbench.mjcf.xml",
        "xml_hash": "legbench.mjcf.xml",
    },
)
