"""A session whose samples are as the device sent them.

What a driver or a program did to them afterwards, and can be undone, is undone: before
windows are judged and averaged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from fieldcal.calibration import Calibration
from fieldcal.diagnosis.signal.chain import repair_samples, with_undone_smoothing
from fieldcal.effects import catalogue
from fieldcal.physics.effect import Chain
from fieldcal.session.folder import Session
from fieldcal.session.refused_samples import refuse_samples_of_no_imu


def repaired_session(session: Session) -> tuple[Session, tuple[str, ...]]:
    """The session with corrected samples, and sentences about what was undone.

    Raises
    ------
    InputError
        If samples to be corrected are not those of one IMU: corrected, they would no
        longer show it.

    """
    if not session.positions:
        return session, ()
    block, faults = repair_samples(session.block, session.about)
    if not faults:
        return session, ()
    refuse_samples_of_no_imu(session.block, session.about.windows)
    about = with_undone_smoothing(session.about, faults)
    right = replace(session, about=about, warnings=())
    right.__dict__["block"] = block
    effects = catalogue()
    said = (
        effect.say_repaired(fault)
        for name, fault in faults
        if isinstance(effect := effects[name], Chain)
    )
    return right, tuple(said)


def with_repairs(calibration: Calibration, repaired: Sequence[str]) -> Calibration:
    """The calibration of corrected samples, which says first what was undone."""
    return replace(calibration, warnings=(*repaired, *calibration.warnings))
