"""What a virtual device does when it is told to, by a script or by keys."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.sim_device.effect import AXES
from fieldcal.sim_device.joints import Angles
from fieldcal.sim_device.line_faults import KINDS, MOST

if TYPE_CHECKING:
    from fieldcal.sim_device.stream import DeviceStream

Reply = dict[str, Any]

ANGLES = ("alpha_deg", "beta_deg", "gamma_deg")
"""What the angles are called in orders and replies."""


def carry_out(stream: DeviceStream, request: Mapping[str, Any]) -> Reply:
    """Do what one request says; the keys are those of the control socket.

    Raises
    ------
    InputError
        If it is not understood; nothing has happened then.

    """
    if len(request) != 1 or (name := next(iter(request))) not in _ORDERS:
        raise InputError(
            f"a request has one key of {', '.join(_ORDERS)}, not {', '.join(request)}"
        )
    given = request[name]
    if isinstance(given, Mapping):
        values = dict(given)
    elif given in (True, None):
        values = {}
    else:
        raise InputError(f'{name} takes an object, as in {{"{name}": {{}}}}')
    time = stream.device.time
    return {"time_s": time, **_ORDERS[name](stream, values)}


def _turn(stream: DeviceStream, given: dict[str, Any]) -> Reply:
    where = _angles(stream, given)
    at, seconds = _optional(given, "at_s"), _optional(given, "seconds")
    _nothing_else("turn", given, (*ANGLES, "seconds", "at_s"))
    alpha, beta, gamma = where
    until = stream.device.turn(alpha, beta, seconds, at, gamma)
    return {"until_s": until}


def _spin(stream: DeviceStream, given: dict[str, Any]) -> Reply:
    where = _angles(stream, given)
    at, seconds = _optional(given, "at_s"), _optional(given, "seconds")
    rate = given.pop("rate_deg_s", None)
    if not isinstance(rate, list) or len(rate) != len(AXES):
        raise InputError("spin needs rate_deg_s, three numbers about x, y, z")
    x, y, z = (_number({"rate_deg_s": r}, "rate_deg_s", 0.0) for r in rate)
    _nothing_else("spin", given, ("rate_deg_s", *ANGLES, "seconds"))
    turning = (math.radians(x), math.radians(y), math.radians(z))
    return {"until_s": stream.device.spin(turning, where, seconds, at)}


def _bump(stream: DeviceStream, given: dict[str, Any]) -> Reply:
    push, tilt_deg = _number(given, "push", 2.0), _number(given, "tilt_deg", 0.5)
    seconds, at = _number(given, "seconds", 0.5), _optional(given, "at_s")
    _nothing_else("bump", given, ("push", "tilt_deg", "seconds", "at_s"))
    return {"until_s": stream.device.bump(push, tilt_deg, seconds, at)}


def _fault(stream: DeviceStream, given: dict[str, Any]) -> Reply:
    times = {name: _at_least_0(given, name) for name in ("silence_s", "hangup_s")}
    times["reboot_s"] = _at_least_0(given, "reboot_s")
    counts = {name: _count(given, name) for name in ("duplicate_stamps", "late_stamps")}
    jitter = _at_least_0(given, "jitter_s") if "jitter_s" in given else None
    ppm = _optional(given, "skew_ppm")
    takes = (*times, *counts, "jitter_s", "skew_ppm", *KINDS)
    _nothing_else("fault", given, takes, KINDS)
    if not (any(times.values()) or any(counts.values()) or given) and (
        jitter is None and ppm is None
    ):
        raise InputError(f"fault needs one of {', '.join(takes)}")
    if given:
        stream.faults.order(given)
    stream.stamps.duplicate(counts["duplicate_stamps"])
    stream.stamps.swap(counts["late_stamps"])
    if jitter is not None:
        stream.delay.mean = jitter
    if ppm is not None:
        stream.stamps.drift(stream.device.time, ppm)
    does = (stream.silence, stream.hang_up, stream.reboot)
    until = [do(s) for do, s in zip(does, times.values(), strict=True) if s]
    return {"until_s": max(until, default=stream.device.time)}


def _status(stream: DeviceStream, given: dict[str, Any]) -> Reply:
    _nothing_else("status", given, ())
    device = stream.device
    return {
        **dict(zip(ANGLES, np.rad2deg(device.angles).tolist(), strict=True)),
        "moving": device.time < device.busy_until,
        "attached": stream.link.attached(),
        "port": stream.link.address,
        "pending_bytes": stream.link.pending,
    }


def _stop(stream: DeviceStream, given: dict[str, Any]) -> Reply:
    _nothing_else("stop", given, ())
    stream.stop()
    return {"stopped": True}


_ORDERS: Mapping[str, Callable[[DeviceStream, dict[str, Any]], Reply]] = {
    "turn": _turn,
    "spin": _spin,
    "bump": _bump,
    "fault": _fault,
    "status": _status,
    "stop": _stop,
}


def _angles(stream: DeviceStream, given: dict[str, Any]) -> Angles:
    """Angles asked for, rad; one that is not given stays as it is."""
    now = np.rad2deg(stream.device.angles).tolist()
    pairs = zip(ANGLES, now, strict=True)
    alpha, beta, gamma = (math.radians(_number(given, k, v)) for k, v in pairs)
    return alpha, beta, gamma


def _optional(given: dict[str, Any], name: str) -> float | None:
    return _number(given, name, 0.0) if name in given else None


def _number(given: dict[str, Any], name: str, default: float) -> float:
    if name not in given:
        return default
    value = given.pop(name)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not math.isfinite(value):
        raise InputError(f"{name} must be a number, not {value!r}")
    return float(value)


def _at_least_0(given: dict[str, Any], name: str) -> float:
    value = _number(given, name, 0.0)
    if value < 0:
        raise InputError(f"{name} must be 0 or more, not {value:g}")
    return value


def _count(given: dict[str, Any], name: str) -> int:
    value = _at_least_0(given, name)
    if value != int(value) or value > MOST:
        raise InputError(f"{name} must be a whole number from 0 to {MOST}")
    return int(value)


def _nothing_else(
    name: str,
    left: Mapping[str, Any],
    takes: tuple[str, ...],
    may: tuple[str, ...] = (),
) -> None:
    for key in left:
        if key not in may:
            some = ", ".join(takes) or "nothing"
            raise InputError(f"{name} does not take {key!r}; it takes {some}")
