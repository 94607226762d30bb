"""Units as headings write them, and which of them a kind of channel may have."""

from __future__ import annotations

import re

from fieldcal.importing.words.tick_units import parse_tick

SPELLINGS = {
    "m/s^2": ("m/s^2", "m/s2", "m/s²", "m/s/s", "m/s**2", "mps2", "m s-2", "ms-2",
              "m s^-2", "m/(s^2)", "m.s-2", "m.s^-2", "m/sec^2", "m/(sec^2)",
              "m*s^-2", "ms^-2", "ms/2", "m/sec2", "m/sec²",
              "meters/sec2", "meters/sec^2", "meters/s^2"),
    "mm/s^2": ("mm/s^2", "mm/s2", "mm/s²", "mmps2"),
    "cm/s^2": ("cm/s^2", "cm/s2", "cm/s²", "gal"),
    "ft/s^2": ("ft/s^2", "ft/s2", "ft/s²", "ft/s/s", "ft/sec^2", "ft/sec2", "fps2"),
    "in/s^2": ("in/s^2", "in/s2", "in/s²", "in/s/s", "in/sec^2", "in/sec2", "ips2"),
    "mg": ("mg", "mgₙ", "milli g", "millig"),
    "ug": ("ug", "µg", "μg", "microg", "micro g"),
    "g": ("g", "g's", "gs", "g-force", "gforce", "g0", "gn", "gₙ"),
    "deg/s": ("deg/s", "°/s", "dps", "degps", "deg s-1", "deg/sec", "°/sec", "d/s",
              "deg s^-1", "deg.s-1", "deg.s^-1", "degrees/s", "degree/s",
              "degrees/sec", "degrees/second", "deg/second", "º/s", "o/s"),
    "mdeg/s": ("mdeg/s", "mdps", "m°/s", "millideg/s", "mdeg/sec"),
    "udeg/s": ("udeg/s", "udps", "µdps", "μdps"),
    "deg/h": ("deg/h", "°/h", "deg/hr", "°/hr", "dph", "deg/hour"),
    "mrad/s": ("mrad/s", "mradps"),
    "urad/s": ("urad/s", "µrad/s", "μrad/s"),
    "rev/s": ("rev/s", "r/s", "revs/s", "rev/sec", "revolutions/s"),
    "rpm": ("rpm", "r/min", "rev/min", "revs/min"),
    "rad/s": ("rad/s", "radps", "rad s-1", "rad/sec", "rps", "rad s^-1", "rad.s-1",
              "rad.s^-1", "radians/s", "radian/s", "radians/sec", "radians/second",
              "rad/second"),
    "s": ("s", "sec", "secs", "seconds", "second"),
    "ms": ("ms", "msec", "msecs", "millis", "milliseconds", "millisecond"),
    "us": ("us", "µs", "μs", "usec", "usecs", "micros", "microseconds",
           "microsecond"),
    "ns": ("ns", "nsec", "nsecs", "nano", "nanos", "nanosec", "nanosecs",
           "nanoseconds", "nanosecond"),
    "min": ("min", "mins", "minute", "minutes"),
    "h": ("h", "hrs"),
    "deg C": ("c", "°c", "°", "'c", "degc", "deg c", "celsius", "℃", "degrees c",
              "deg.c", "ºc", "cel", "degrees celsius", "deg celsius", "degree c",
              "degree celsius"),
    "cdeg C": ("cdegc", "c°c", "centi deg", "centi deg c", "centidegc", "centi degc",
               "centidegrees c", "centidegrees celsius"),
    "ddeg C": ("ddegc", "d°c", "deci deg", "decidegc", "deci degc", "decidegrees c",
               "decidegrees celsius", "0.1 degc", "0.1degc", "0.1°c", "0.1 °c"),
    "mdeg C": ("mdegc", "m°c", "milli deg", "milli deg c", "millidegc", "milli degc",
               "milli °c", "millidegrees c", "millidegrees celsius",
               "milli degrees celsius"),
    "K": ("kelvin", "degk", "deg k"),
    "deg F": ("°f", "degf", "deg f", "fahrenheit", "℉", "degrees f", "ºf",
              "degrees fahrenheit", "deg fahrenheit"),
}  # fmt: skip
"""How each unit is written."""

CAPITALS = {"K": "K", "F": "deg F"}
"""Units only as capital letters: small ones count steps, or say what is filtered."""

TEMPERATURES = {"deg C": "degC", "ddeg C": "ddegC", "cdeg C": "cdegC",
                "mdeg C": "mdegC", "K": "K", "deg F": "degF"}  # fmt: skip
"""Units of temperatures, and what ``--temp-unit`` calls them."""

THERMOMETERS = (*SPELLINGS["K"], *SPELLINGS["deg F"], *SPELLINGS["cdeg C"],
                *SPELLINGS["ddeg C"],
                *SPELLINGS["mdeg C"], "°c", "degc", "deg c", "celsius",
                "℃", "degrees c", "deg.c", "ºc", "cel", "degrees celsius",
                "deg celsius", "degree c", "degree celsius")  # fmt: skip
"""Units that tell a thermometer, whatever it is called: a lone c or ° may be any."""

HALF_ANGLE = "half rad"
"""What names of rates tell where they are half the angle since the row before."""

_UNIT_BEHIND = re.compile(r"(.*?)[\s_.]*([(\[][^()\[\]]*[)\]]|[^\s_.()\[\]]+)")
"""A name with what may be its unit, in brackets or as the last word."""

_WRITTEN = {text: unit for unit, texts in SPELLINGS.items() for text in texts}

OF_RATES = ("rad/s", "deg/s", "mrad/s", "mdeg/s", "udeg/s", "deg/h", "urad/s")
"""Units of rates of a device; in revolutions turn motors as well."""

TELLING = ("m/s^2", "mm/s^2", "ft/s^2", "in/s^2", *OF_RATES)
"""Units that tell the kind of a sensor, whatever its axes are called."""

UNITS = {
    "a": ("m/s^2", "mm/s^2", "cm/s^2", "ft/s^2", "in/s^2", "g", "mg", "ug"),
    "g": (*OF_RATES, "rev/s", "rpm"),
    "t": ("s", "ms", "us", "ns", "min", "h"),
    "dt": ("s", "ms", "us", "ns"),
    "temperature": tuple(TEMPERATURES),
    "m": (),
    "seq": (),
    "t_h": (),
    "t_min": (),
    "t_host": (),
    "v": ("m/s^2", "g", "mg"),
    "l": (),
    "low_a": (),
    "low_g": (),
    "dv_us": (),
    "da_us": (),
    "": ("m/s^2", "g", "mg", *TELLING),
}
"""Units that a kind of channel may have; of an axis alone, those that tell its kind."""


def parse_unit(text: str) -> str | None:
    """Parse a text as a unit, with or without brackets; None if it is none.

    >>> [parse_unit(text) for text in (" (°/s)", "g", "rad per sec", "0.1 ms", "x")]
    ['deg/s', 'g', 'rad/s', '0.1ms', None]
    """
    bare = text.strip()
    # of "(m/(s^2))" the outer brackets, of "m/(s^2)" none
    while bare.lower() not in _WRITTEN and bare[:1] + bare[-1:] in ("()", "[]"):
        bare = bare[1:-1].strip()
    if bare in CAPITALS:
        return CAPITALS[bare]
    bare = bare.lower().replace("/per/", "/").replace(" per ", "/")
    return _WRITTEN.get(bare) or _WRITTEN.get(bare.strip("[]() ")) or parse_tick(bare)


def is_unit_of(unit: str, kind: str) -> bool:
    """Whether a kind of channel may have a unit; of times, also so many of one.

    >>> is_unit_of("0.1ms", "t"), is_unit_of("0.1ms", "a"), is_unit_of("g", "a")
    (True, False, True)
    """
    return unit in UNITS[kind] or (kind == "t" and parse_tick(unit) is not None)


def sensor_of_unit(text: str) -> str:
    """Kind of sensor, a or g, whose values have a unit; "" of any other text.

    >>> sensor_of_unit("G"), sensor_of_unit("o/s"), sensor_of_unit("m")
    ('a', 'g', '')
    """
    unit = parse_unit(text)
    return next((kind for kind in "ag" if unit in UNITS[kind]), "")


def split_thermometer_name(name: str, unit: str) -> tuple[str, str] | None:
    """Name and unit of what only its unit says to be a thermometer; None of another.

    Parameters
    ----------
    name : of a column
    unit : what the file says of it elsewhere, or nothing

    >>> split_thermometer_name("imu_degC", ""), split_thermometer_name("°C", "")
    (('imu', 'deg C'), ('', 'deg C'))
    >>> split_thermometer_name("roll (°)", ""), split_thermometer_name("quat_c", "")
    (None, None)
    """
    split = _UNIT_BEHIND.fullmatch(name)
    pairs = [(split[1], split[2])] if split else []
    for bare, written in (("", name), *pairs, (name, unit)):
        if written.strip().strip("[]() ").lower() in THERMOMETERS:
            return bare, parse_unit(written) or ""
    return None
