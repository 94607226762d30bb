"""A file whose IMUs each have a part of it alone: a group, or rows of their own."""

from __future__ import annotations

from abc import abstractmethod
from typing import Self

from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import Recording
from fieldcal.importing.tables.column_recording import ColumnRecording


class DividedRecording(ColumnRecording):
    """A file with one IMU in it, or with several that may be read apart."""

    parts_found: dict[str, Self] | None = None
    """The file with one part alone, by the name of its IMU, so that it is found once.
    """

    @abstractmethod
    def _in_parts(self) -> dict[str, Self]:
        """The file with one part alone, where there are several."""

    def imus(self) -> dict[str, ReadOptions]:
        """Options of each IMU, of which each may have a part of its own."""
        if self.imus_found is None and (parts := self._in_parts()):
            self.imus_found = {}
            for name, part in parts.items():
                (wanted,) = part.imus().values()
                self.imus_found[name] = wanted
                part.imus_found = {name: wanted}
                self.says += [s for s in part.says if s not in self.says]
        return super().imus()

    def alone(self, stream: str) -> Recording:
        """The recording of one IMU, as far as it has a part of its own."""
        return self._in_parts().get(stream) or super().alone(stream)
