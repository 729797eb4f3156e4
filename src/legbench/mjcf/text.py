"""The MJCF text of a leg, made once for all who need it in a row."""

from functools import lru_cache

from legbench.design import LegDesign
from legbench.mjcf.build import build_spec
from legbench.mjcf.options import BuildOptions
from legbench.mjcf.xml import to_xml


@lru_cache(maxsize=1)
def model_text(design: LegDesign, options: BuildOptions) -> str:
    """MJCF of a design; the last one is kept, since a run and its plant want the same.

    Raises:
        ConfigError: as `build_spec`.
    """
    return to_xml(build_spec(design, options))
