"""Grades of devices, by what a factory leaves; an MPU-6050 is of consumer grade."""

from __future__ import annotations

from typing import Literal, get_args

Grade = Literal["consumer", "tactical", "navigation"]

GRADES: tuple[Grade, ...] = get_args(Grade)
