"""Units as headings write them, and which of them a kind of channel may have."""

from __future__ import annotations

SPELLINGS = {
    "m/s^2": ("m/s^2", "m/s2", "m/s²", "m/s/s", "m/s**2", "mps2", "m s-2", "ms-2",
              "m s^-2", "m/(s^2)", "m.s-2", "m.s^-2", "m/sec^2", "m/(sec^2)",
              "m*s^-2", "ms^-2", "m/sec2", "m/sec²"),
    "mm/s^2": ("mm/s^2", "mm/s2", "mm/s²", "mmps2"),
    "cm/s^2": ("cm/s^2", "cm/s2", "cm/s²", "gal"),
    "mg": ("mg", "milli g", "millig"),
    "ug": ("ug", "µg", "μg", "microg", "micro g"),
    "g": ("g", "g's", "gs", "g-force", "gforce", "g0", "gn"),
    "deg/s": ("deg/s", "°/s", "dps", "degps", "deg s-1", "deg/sec", "°/sec", "d/s",
              "deg s^-1", "deg.s-1", "deg.s^-1", "degrees/s", "degree/s",
              "degrees/sec", "degrees/second", "deg/second", "º/s"),
    "mdeg/s": ("mdeg/s", "mdps", "m°/s", "millideg/s", "mdeg/sec"),
    "udeg/s": ("udeg/s", "udps", "µdps", "μdps"),
    "deg/h": ("deg/h", "°/h", "deg/hr", "°/hr", "dph", "deg/hour"),
    "mrad/s": ("mrad/s", "mradps"),
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
    "deg C": ("c", "°c", "°", "degc", "deg c", "celsius", "℃", "degrees c", "deg.c",
              "ºc"),
}  # fmt: skip
"""How each unit is written."""

_WRITTEN = {text: unit for unit, texts in SPELLINGS.items() for text in texts}

TELLING = ("m/s^2", "mm/s^2", "rad/s", "deg/s", "mrad/s", "mdeg/s", "udeg/s", "deg/h")
"""Units that tell the kind of a sensor, whatever its axes are called."""

UNITS = {
    "a": ("m/s^2", "mm/s^2", "cm/s^2", "g", "mg", "ug"),
    "g": ("rad/s", "deg/s", "mrad/s", "mdeg/s", "udeg/s", "deg/h"),
    "t": ("s", "ms", "us", "ns", "min"),
    "dt": ("s", "ms", "us", "ns"),
    "temperature": ("deg C",),
    "m": (),
    "seq": (),
    "t_host": (),
    "v": ("m/s^2", "g", "mg"),
    "l": (),
    "": ("m/s^2", "g", "mg", *TELLING),
}
"""Units that a kind of channel may have; of an axis alone, those that tell its kind."""


def parse_unit(text: str) -> str | None:
    """Parse a text as a unit, with or without brackets; None if it is none.

    >>> [parse_unit(text) for text in (" (°/s)", "g", "rad per sec", "x")]
    ['deg/s', 'g', 'rad/s', None]
    """
    bare = text.strip()
    # of "(m/(s^2))" the outer brackets, of "m/(s^2)" none
    while bare.lower() not in _WRITTEN and bare[:1] + bare[-1:] in ("()", "[]"):
        bare = bare[1:-1].strip()
    bare = bare.lower().replace("/per/", "/").replace(" per ", "/")
    return _WRITTEN.get(bare) or _WRITTEN.get(bare.strip("[]() "))
