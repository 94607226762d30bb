"""Exceptions, and the exit code of the command line for each.

FieldcalError                2
+-- InputError               2  what the user gave cannot be used
|    +-- SessionError        2  a session folder: names file, place and remedy
|    |    +-- SessionInUse   2  another run records into it
|    +-- PlanError           2  a plan, refused before anything moves
|    +-- NotObservable       2  the positions cannot determine what was asked for
+-- DeviceError              3  the link to the device failed
|    +-- DeviceSilent        3  no sample came in time
|    +-- LinkLost            3  the link broke during a run
|    +-- RecordingEnded      3  a recording that is played has no more samples
|    +-- MoverFailed         3  what turns the device did not do so
|         +-- MoverGone      3  it may come back
+-- Moved                    1  the device was not still during a window
+-- WrongPosition            1  the device is not where the procedure needs it
+-- CalibrationFailed        1  the procedure could not reach a result
+-- Skipped                  1  the operator leaves a position out
+-- Stopped                130  the operator ends the run

Texts are for the operator: what happened, where, what to do now. One sentence.
"""

from __future__ import annotations

import errno
from typing import ClassVar


class FieldcalError(Exception):
    """Base of every error raised on purpose; the text is for the operator.

    Attributes
    ----------
    printed : whether a result was printed all the same

    """

    exit_code: ClassVar[int] = 2
    printed = False


class InputError(FieldcalError):
    """What the user gave cannot be used."""


class SessionError(InputError):
    """A session folder cannot be read or written."""


class SessionInUse(SessionError):
    """Another run records into a session folder."""


class PlanError(InputError):
    """A plan is wrong; refused before anything moves."""


class NotObservable(InputError):
    """The positions cannot determine what was asked for."""


class DeviceError(FieldcalError):
    """The link to the device failed."""

    exit_code = 3


class DeviceSilent(DeviceError):
    """No sample came in time."""


class LinkLost(DeviceError):
    """The link was there and is gone.

    Attributes
    ----------
    fault : what happened and what to check, without what a caller may do next

    """

    def __init__(self, fault: str) -> None:
        super().__init__(f"{fault}, then start again")
        self.fault = fault


class RecordingEnded(DeviceError):
    """A recording that is played as a device has no more samples.

    Parameters
    ----------
    name : of the recording
    seconds : that it lasted, s

    """

    def __init__(self, name: object, seconds: float) -> None:
        super().__init__(f"{name} has ended after {seconds:.3f} s")


class MoverFailed(DeviceError):
    """The mover failed to turn the device."""


class MoverGone(MoverFailed):
    """The mover is not there now, or says that it could not; it may come back."""


class Moved(FieldcalError):
    """The device was not still during a window.

    Attributes
    ----------
    at : device time of the disturbance, s
    axis : name of the channel that shows it, e.g. ``"ax"``
    seconds : how long it lasts as it shows; so long before `at` it may have begun

    """

    exit_code = 1

    def __init__(self, text: str, at: float, axis: str, seconds: float = 0.0) -> None:
        super().__init__(text)
        self.at = at
        self.axis = axis
        self.seconds = seconds


class WrongPosition(FieldcalError):
    """The device is not where the procedure needs it."""

    exit_code = 1


class CalibrationFailed(FieldcalError):
    """The procedure could not reach a result."""

    exit_code = 1


class Skipped(FieldcalError):
    """The operator leaves a position out."""

    exit_code = 1


class Stopped(FieldcalError):
    """The operator ends the run."""

    exit_code = 130


_DISK = {
    errno.ENOSPC: "the disk is full: make room on it, or name another",
    errno.EDQUOT: "your share of the disk is used up: make room, or name another disk",
    errno.EFBIG: "the disk takes no file of that size: name another disk",
    errno.EROFS: "the disk is read-only: name another",
    errno.EACCES: "you may not write there: name another folder",
    errno.EPERM: "you may not write there: name another folder",
    errno.ENOTDIR: "a file is in the way of the folder: name another",
    errno.ENOENT: "the folder is not there: make it, or name another",
    errno.EIO: "the disk does not answer: put it in again, or name another",
    errno.ENODEV: "the disk is gone: put it in again, or name another",
    errno.ENXIO: "the disk is gone: put it in again, or name another",
    errno.ESTALE: "the disk is gone: put it in again, or name another",
}


def disk_says(error: OSError) -> str:
    """Why a file cannot be written, and what to do.

    >>> disk_says(OSError(errno.ENOSPC, "No space left on device"))
    'the disk is full: make room on it, or name another'
    """
    return _DISK.get(error.errno or 0) or error.strerror or str(error)
