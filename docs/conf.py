"""How the documentation is built: `make docs`.

Drawings of positions and pictures of effects are made from the code when the site is
built, into docs/made/, so that they cannot differ from what the code does.
"""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from drawn import mathematics, pages  # noqa: E402

from fieldcal.core.version import __version__  # noqa: E402

project = "fieldcal"
author = "fieldcal"
project_copyright = "the authors of fieldcal"
release = version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
highlight_language = "text"  # most examples are commands
source_suffix = {".md": "markdown"}
exclude_patterns = ["drawn", "_site"]
suppress_warnings = ["myst.xref_missing"]

autodoc_member_order = "bysource"
autodoc_typehints = "none"
smartquotes = False
autosummary_generate = False
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

html_theme = "furo"
html_static_path = ["style"]
html_css_files = ["site.css"]
html_title = f"fieldcal {version}"
html_copy_source = False
html_show_sphinx = False
html_math_renderer = "mathml"


def setup(app):  # noqa: D103, ANN001, ANN201
    pages.make(HERE / "made")
    mathematics.setup(app)
