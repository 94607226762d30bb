"""Option that is repeated for each of several devices on the same table."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any


class StoreRepeated(argparse.Action):
    """Stores the first value in ``dest``, further ones in a list ``further_dest``."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        """Store a value."""
        if getattr(namespace, self.dest) is None:
            setattr(namespace, self.dest, values)
        else:
            further = f"further_{self.dest}"
            setattr(namespace, further, [*getattr(namespace, further, []), values])
