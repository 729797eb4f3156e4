"""Settings of the documentation site, which `make docs` builds.

The source folder is that of the project, so that README, docs and hardware are read where they lie
and their links are those of a repository browser.
"""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_sphinx"), str(HERE.parent / "src")]

from legbench import __version__  # noqa: E402

project = "legbench"
version = release = __version__
html_title = f"legbench {version}"
root_doc = "docs/index"
extensions = ["myst_parser", "sphinx.ext.autodoc", "reference_pages"]
include_patterns = ["docs/index.md", "README.md", "CHANGELOG.md", "docs/**", "hardware/*.md"]
exclude_patterns = [".*", "docs/_*", "runs", "src", "tests", "scripts", "models", "dist", "typings"]

myst_heading_anchors = 4
default_role = "literal"
nitpicky = True
nitpick_ignore_regex = [("py:.*", r"(?!legbench\.).*"), ("py:.*", r".*\._.*")]
"""Other libraries have no pages here; every name of the project that is shown must have one."""

autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "undoc-members": True}
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True

html_theme = "furo"
html_extra_path = ["_static/index.html"]
html_copy_source = False
html_show_copyright = False
