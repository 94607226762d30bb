"""How much somebody may send, and what one job may use."""

from __future__ import annotations

from dataclasses import dataclass

MIB = 1 << 20


@dataclass(frozen=True, slots=True)
class Bounds:
    """Bounds of a service.

    Attributes
    ----------
    upload : bytes of one recording as it is sent
    unpacked : bytes of what is in an archive, and of any file that is made of it
    members : files in an archive
    jobs : that wait, at most
    kept : jobs that are kept; the oldest that are over go first
    seconds : of processor time for one job

    """

    upload: int = 256 * MIB
    unpacked: int = 2048 * MIB
    members: int = 64
    jobs: int = 32
    kept: int = 1000
    seconds: int = 1800
