"""An option that is given once for each of several devices on the same table."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any


class StoreSeveral(argparse.Action):
    """The first goes where the option says, the others to a list ``further_…``."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        """Take what was given once more."""
        if getattr(namespace, self.dest) is None:
            setattr(namespace, self.dest, values)
        else:
            further = f"further_{self.dest}"
            setattr(namespace, further, [*getattr(namespace, further, []), values])
