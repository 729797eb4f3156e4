"""Rewrite the MJCF files of models/, which are reviewed as they change."""

from pathlib import Path

from legbench.design import load_design
from legbench.mjcf import BuildOptions, build_spec, to_xml

MODELS = Path(__file__).parent.parent / "models"


def main() -> None:
    """One file a design, in the jumping setup with bars."""
    for design in sorted(MODELS.glob("*.toml")):
        target = design.with_suffix(".xml")
        target.write_text(to_xml(build_spec(load_design(design), BuildOptions())), encoding="utf-8")
        print(f"wrote {target.name}")


if __name__ == "__main__":
    main()
