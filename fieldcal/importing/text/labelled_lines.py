"""Lines of values with their labels: which of them make a row, and of which device.

--- Gyro (deg/s) ---               a title, or what a line is called, says the
X: 1 Y: 2 Z: 3                     sensor of axes without one

A: t: 0.01 x: 0.1 y: 0.2 z: 9.8    lines of one time are one row
G: t: 0.01 x: 1 y: 2 z: 3

left: ax: 0.1 ay: 0.2 az: 9.8      names of lines with the same labels tell
right: ax: 0.2 ay: 9.7 az: 0.1     devices apart

Instance 0:                        a title that numbers devices says which the lines
x: 0.1                             below it are of, down to the next
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Sequence

from fieldcal.importing.text.labels import (
    CLOCKS,
    Labelled,
    complete_label,
    named_values,
)
from fieldcal.importing.text.repeated_lines import (
    count_sentences,
    line_shape,
    name_axes,
    repeated_labels,
    repeated_shapes,
)
from fieldcal.importing.text.text_form import MOSTLY, Reader, TextForm, take_row
from fieldcal.importing.words.device_names import tells_devices
from fieldcal.importing.words.heading_words import heading_meaning
from fieldcal.importing.words.sensor_words import AXES

DEVICE = "device"
"""Column of what lines are called, where it tells devices apart."""

MIN_LINES = 2
"""Lines of each device among the first."""

_TITLE = re.compile(r"\W*([A-Za-z][\w ]*(?:\([^()]*\)|\[[^\[\]]*\])?)\W*")
"""A line that holds nothing but a name."""


_NUMBERED = re.compile(r"\W*([A-Za-z]+)[ #_-]*(\d+)\W*")
"""A title with a number."""


class TitledValues:
    """Labels and values of lines in which a title names the sensor of the next axes.

    What stands alone before the labels of a line is a title of its own, or else says
    of which device it may be.

    Attributes
    ----------
    titles : lines of that kind so far
    devices : how often each device was named by a title

    >>> titled = TitledValues()
    >>> [titled.of(line) for line in ("--- Gyro (deg/s) ---", "X: 1 Y: 2")]
    [[], [('Gyro X [deg/s]', '1'), ('Gyro Y [deg/s]', '2')]]
    >>> titled.of("A: x: 1 y: 2"), titled.of("left: ax: 1")
    ([('A x', '1'), ('A y', '2')], [('device', 'left'), ('ax', '1')])
    """

    def __init__(self) -> None:
        self._title = self._unit = self._device = ""
        self.titles = 0
        self.devices: Counter[str] = Counter()

    def of(self, line: str) -> list[Labelled]:
        """Labels and values of the next line."""
        called, labelled = named_values(line)
        read = [*labelled]
        if called and _is_sensor(called):
            return _of_sensor(read, called, "")
        if not read and self._names_device(line):
            return []
        title = None if read else _TITLE.fullmatch(line)
        if title is not None:
            bare, unit = complete_label(" ".join(title[1].split()), [])
            if _is_sensor(bare):
                self._title, self._unit = bare, f" [{unit}]" if unit else ""
                self.titles += 1
        if self._title:
            read = _of_sensor(read, self._title, self._unit)
        device = called or self._device
        return [(DEVICE, device), *read] if device and read else read

    def _names_device(self, line: str) -> bool:
        """Whether a line is a title that numbers a device; its lines follow then."""
        numbered = _NUMBERED.fullmatch(line)
        if numbered is None or not tells_devices(numbered[1]):
            return False
        self._device = f"{numbered[1]} {numbered[2]}"
        self.devices[self._device] += 1
        self.titles += 1
        return True


class LabelledValues(TextForm):
    """Values with their labels, as a program prints them for people.

    Its other lines, those that come again and again, are no damaged rows.
    """

    def __init__(
        self,
        names: Sequence[str],
        separator: str,
        gathers: bool,
        others: Collection[str],
        devices: Collection[str],
    ) -> None:
        self.names, self._separator, self.gathers = tuple(names), separator, gathers
        self._others, self._devices = others, devices
        self._stays = {name for name in names if _says_row(name)}

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> LabelledValues | None:
        """The form, if most lines have it."""
        titled = TitledValues()
        read = [titled.of(line) for line in lines]
        many = [row for row in read if row]
        devices = _devices(many) | _often(titled.devices)
        labels = {name for row in many for name, _ in row}
        stay = CLOCKS | {name for name in labels if _says_row(name)}
        names = repeated_labels(many, stay)
        names = [name for name in names if devices or name != DEVICE]
        told = len(many) + titled.titles
        others = [one for one, row in zip(lines, read, strict=True) if not row]
        # of what a program prints besides, no sentence speaks against its labels
        most = len(lines) - count_sentences(others) if name_axes(names) else len(lines)
        if told <= MOSTLY * most or len(names) < len("xyz"):
            return None
        gathers = max(len({n for n, _ in row} & {*names}) for row in many) < len(names)
        shapes = repeated_shapes(others, names)
        return cls(names, separator or "\t", gathers, shapes, devices)

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        row: dict[str, str] = {}
        titled, begun = TitledValues(), False

        def read(lines: Sequence[str]) -> list[str]:
            nonlocal begun
            found = []
            for line in lines:
                titles = titled.titles
                said = titled.of(line)
                bare = not said and titles == titled.titles
                values = self._values(said)
                begun = begun or bool(values)
                if said and not begun:
                    # what stands above the rows may say their rate
                    found.append(line)
                if bare and line_shape(line) not in self._others:
                    # no row: whoever reads rows says so
                    found.append(line)
                if self._is_another(row, values):
                    found.append(take_row(row, self.names, self._separator))
                # a row has the time of its first line
                row.update({k: v for k, v in values.items() if k not in row})
                if len(row) == len(self.names):
                    found.append(take_row(row, self.names, self._separator))
            return found

        return read

    def _values(self, said: Sequence[Labelled]) -> dict[str, str]:
        """Values of a line that are in columns; none of another device or message.

        Whatever has nothing but its time and its name in columns is another message.
        """
        values = {k: v for k, v in said if k in self.names}
        others = {k for k, _ in said} - self._stays - CLOCKS
        if others and not others & values.keys():
            return {}
        return values if values.get(DEVICE, "") in ("", *self._devices) else {}

    def _is_another(self, row: dict[str, str], values: dict[str, str]) -> bool:
        """Whether values of a line are not of a row that has begun."""
        return any(
            values[name] != row[name] if name in self._stays else name not in CLOCKS
            for name in row.keys() & values.keys()
        )


def _is_sensor(name: str) -> bool:
    """Whether a name says which sensor has axes."""
    said = heading_meaning(f"{name} x")
    return said is not None and bool(said.kind)


def _of_sensor(read: Iterable[Labelled], sensor: str, unit: str) -> list[Labelled]:
    """Labels and values with a sensor before what is an axis alone, and its unit."""
    return [(f"{sensor} {name}{unit}" if name.partition(" [")[0].lower() in AXES
             else name, value) for name, value in read]  # fmt: skip


def _says_row(name: str) -> bool:
    """Whether a label is the same in all lines of a row: a time, or the device.

    The time that is written before each line is not.
    """
    if name in CLOCKS:
        return False
    said = heading_meaning(name.partition(" [")[0])
    return name == DEVICE or (said is not None and said.kind == "t")


def _often(titles: Counter[str]) -> set[str]:
    """Devices that titles number again and again, if there are several."""
    several = len(titles) > 1 and min(titles.values()) >= MIN_LINES
    return {*titles} if several else set()


def _devices(rows: Iterable[Sequence[Labelled]]) -> set[str]:
    """What lines with axes are called, where several have the same labels.

    A name that hardly comes again counts lines.
    """
    called: defaultdict[frozenset[str], Counter[str]] = defaultdict(Counter)
    for row in rows:
        if row and row[0][0] == DEVICE:
            called[frozenset(name for name, _ in row[1:])][row[0][1]] += 1
    return {name for labels, names in called.items()
            if len(names) > 1 and min(names.values()) >= MIN_LINES
            and name_axes(labels) for name in names}  # fmt: skip
