"""Pages and pictures that are made when the site is built, into docs/made/."""

from __future__ import annotations

import inspect
from pathlib import Path

from drawn import architecture, installations
from drawn.effects import given, picture
from drawn.positions import drawings
from drawn.screens import screens
from fieldcal.core.positions import POSITION_SETS
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Effect

KINDS = {
    "motion": ("Place, fixture and motion", "They change what the sensors experience."),
    "sensor": ("The sensors", "They add to what the sensors put out."),
    "chain": ("The signal chain", "They happen to the samples."),
}


def make(folder: Path) -> None:
    """Write all of it; what has not changed is left as it is."""
    for part in ("effects", "screens"):
        (folder / part).mkdir(parents=True, exist_ok=True)
    _write(folder / "architecture.html", architecture.drawing())
    for name, positions in POSITION_SETS.items():
        _write(folder / f"positions_{name}.html", drawings(positions))
    for name, one in installations.INSTALLATIONS.items():
        _write(folder / f"installation_{name}.html", installations.drawings(one))
    for effect in catalogue().values():
        _write(folder / "effects" / f"{effect.id}.svg", picture(effect))
    for name, shown in screens().items():
        _write(folder / "screens" / f"{name}.svg", shown)
    _write(folder / "effects.md", _page())


def _write(path: Path, text: str) -> None:
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def _page() -> str:
    parts = [
        "# Effects\n",
        "What a simulation with bias, scale factor and noise can leave out. Each"
        " picture is made by the virtual device: its outputs with the effect less those"
        " without, in five positions (shaded) and the turns between them; of effects in"
        " the signal chain the samples themselves. `fieldcal diagnose` finds them, and"
        " the report says what to do.\n",
    ]
    for kind, (title, lead) in KINDS.items():
        parts.append(f"## {title}\n\n{lead}\n")
        found = [e for e in catalogue().values() if e.kind == kind]
        parts += [_section(effect) for effect in found]
    return "\n".join(parts)


def _section(effect: Effect) -> str:
    title, equations = _explained(effect)
    rows = [f"| `{p.name}` | {p.unit} | {p.typical:g} |" for p in effect.params]
    rows += [f"| `{s.name}` | {s.unit} | |" for s in effect.shapes]
    table = ["| parameter | unit | up to |", "|---|---|---|", *rows, ""] if rows else []
    return "\n".join(
        [
            f"### {effect.id}\n",
            f"{title}\n",
            f"```text\n{equations}\n```\n",
            f"![what {effect.id} adds](effects/{effect.id}.svg)\n",
            f"Virtual device: `--with {given(effect)}`\n",
            *table,
            f"**Seen through** {effect.covariate}. **Told from others by**"
            f" {effect.decided_by}.\n",
            f"**Cure.** {effect.cure}\n",
            f"Source: {effect.source}.\n",
        ]
    )


def _explained(effect: Effect) -> tuple[str, str]:
    """First sentence and the rest of the module's text, without its examples."""
    text = inspect.cleandoc(inspect.getmodule(type(effect)).__doc__ or "")
    title, _, rest = text.partition("\n\n")
    return " ".join(title.split()), rest.partition(">>>")[0].rstrip()
