"""Bounds for uploads and jobs."""

from __future__ import annotations

from dataclasses import dataclass

MIB = 1 << 20


@dataclass(frozen=True, slots=True)
class ServiceBounds:
    """Bounds of a service.

    Attributes
    ----------
    upload : size of one upload, bytes
    unpacked : size of an unpacked archive, and of each file made from it, bytes
    members : number of files in an archive
    jobs : number of unfinished jobs
    kept : number of finished jobs that are kept; the oldest are deleted first
    seconds : processor time of one job, s
    memory : what one job may add to the memory of its process, bytes

    """

    upload: int = 256 * MIB
    unpacked: int = 2048 * MIB
    members: int = 64
    jobs: int = 32
    kept: int = 1000
    seconds: int = 1800
    memory: int = 4096 * MIB
