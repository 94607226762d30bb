"""Means of samples of which some may not be used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from still_samples import samples

from fieldcal.model.rows.block_means import block_means, masked


def test_what_may_not_be_used_is_nan_and_nothing_else() -> None:
    block = samples(1.0)
    usable = np.ones((50, 6), dtype=bool)
    assert masked(block, usable) is block
    usable[3, 1] = usable[4, 5] = False
    found = masked(block, usable)
    np.testing.assert_array_equal(np.isnan(found.six), ~usable)
    np.testing.assert_array_equal(found.six[usable], block.six[usable])
    usable[4, 5] = True
    assert masked(block, usable).gyr is block.gyr
    again = masked(found, usable)
    np.testing.assert_array_equal(np.isnan(again.acc), np.isnan(found.acc))
    already = replace(block, acc=np.where(usable[:, :3], block.acc, np.nan))
    assert masked(already, usable) is already


def test_means_between_bounds_count_what_is_known() -> None:
    """Bounds that follow each other or not; against `nanmean` of each."""
    block = samples(3.0)
    acc = block.acc.copy()
    acc[5:12, 0] = acc[60:70, 2] = np.nan
    bound = np.array([[0, 10], [10, 40], [60, 70], [70, 71], [90, 150]])
    mean, count = block_means(replace(block, acc=acc), bound)
    six = np.hstack([acc, block.gyr])
    for (a, b), found, of in zip(bound, mean, count, strict=True):
        known = np.isfinite(six[a:b])
        np.testing.assert_array_equal(of, known.sum(axis=0))
        total = np.where(known, six[a:b], 0.0).sum(axis=0)
        with np.errstate(invalid="ignore"):
            np.testing.assert_allclose(found, total / of, rtol=1e-12)
