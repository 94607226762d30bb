"""What a virtual device conceals, beside what was found."""

from __future__ import annotations

from fieldcal.commands.table import concealed_values


def test_words_of_an_effect_are_no_values() -> None:
    truth = {
        "acc_bias": [0.1, 0.2, 0.3],
        "effects": {
            "decode_fault": {"channel": "gyr", "kind": "wild", "full_scale": 0},
            "cross_coupling": {"k12": 0.003},
        },
    }
    assert concealed_values(truth) == {
        "acc_bias.x": 0.1, "acc_bias.y": 0.2, "acc_bias.z": 0.3,
        "decode_fault.full_scale": 0.0, "cross_coupling.k12": 0.003,
    }  # fmt: skip
