"""What stands above the columns of a file, and what their names say of one IMU."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from shlex import quote
from typing import NamedTuple

from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.words.heading_units import TEMPERATURES

NAMES = "the names of its columns"
"""What says what its columns are, in most files."""


class Column(NamedTuple):
    """A column of a file.

    Attributes
    ----------
    place : what ``--columns`` calls it: a name, or nothing where columns have none
    name : what stands over it
    unit : what the file says of it elsewhere, or nothing

    """

    place: str
    name: str
    unit: str = ""


class Heading(NamedTuple):
    """Columns of a file, as it names them.

    Attributes
    ----------
    columns : in the order of the file
    skip : what stands for a column that is not wanted; "" where columns have names

    """

    columns: Sequence[Column]
    skip: str = ""


def with_signs(columns: Iterable[str], other_way: Container[str]) -> Iterator[str]:
    """Columns as ``--columns`` names them, with a minus where the sign is turned.

    >>> list(with_signs(["t=time", "ax=f"], {"ax"}))
    ['t=time', '-ax=f']
    """
    for one in columns:
        yield f"-{one}" if one.partition("=")[0] in other_way else one


@dataclass(frozen=True, slots=True)
class HeadingMatch:
    """Columns of one IMU, identified by their names.

    Attributes
    ----------
    columns : as ``--columns`` names them, all
    units : said by the names, by kind of channel; None where they say none
    name : of the IMU, "0" where there is one
    says : what the user must know of them, a sentence each
    usual : unit that rates of such names are in; "" where names tell none
    reversed : channels whose sign is the other one, by what writes such names
    free : whether its accelerations are called as those without gravity are
    no_gain : whether names say accelerations, and so no gains of velocity
    usual_acc : unit that accelerations of such names are in; "" where names tell none

    """

    columns: tuple[str, ...]
    units: Mapping[str, str | None]
    name: str = "0"
    says: tuple[str, ...] = ()
    usual: str = ""
    reversed: frozenset[str] = frozenset()
    free: bool = False
    no_gain: bool = False
    usual_acc: str = ""

    def taken(self, wanted: ReadOptions) -> ReadOptions:
        """Return what the user says, with what the names say."""
        given = {"a": wanted.acc_unit, "g": wanted.gyr_unit, "t": wanted.time_unit}
        units = {k: given.get(k) or unit for k, unit in self.units.items()}
        by_name = {k for k, unit in self.units.items() if unit and not given.get(k)}
        return replace(
            wanted,
            columns=self.columns,
            acc_unit=units.get("a") or wanted.acc_unit,
            gyr_unit=units.get("g") or wanted.gyr_unit,
            time_unit=units.get("t") or wanted.time_unit,
            temp_unit=wanted.temp_unit
            or TEMPERATURES.get(units.get("temperature") or "", ""),
            named=frozenset(by_name),
            usual=self.usual,
            reversed=wanted.reversed | self.reversed,
            free=self.free,
            no_gain=self.no_gain,
            usual_acc=self.usual_acc,
        )

    def sentence(
        self, wanted: ReadOptions, rate_said: bool = False, told_by: str = NAMES
    ) -> str:
        """Say what is taken from the names, as options that do the same.

        Parameters
        ----------
        wanted : the options that are taken
        rate_said : whether the file says its rate, which no option has to say again, or
            its rows need none, as means
        told_by : what says the sensor

        """
        text = f"--columns {quote(','.join(with_signs(self.columns, self.reversed)))}"
        if "t" not in self.units and not (wanted.rate_hz or rate_said):
            text += " --rate HZ"
        for kind, (option, given) in {
            "a": ("--acc-unit", wanted.acc_unit),
            "g": ("--gyr-unit", wanted.gyr_unit),
            "t": ("--time-unit", wanted.time_unit),
        }.items():
            if kind in self.units and (unit := given or self.units[kind]):
                text += f" {option} {quote(unit)}"
        return f"taken from {told_by}: {text}"
