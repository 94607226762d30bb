"""What every test needs: property tests that do not depend on the machine's speed."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# as the commands do: threads for small matrices only wait for each other
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

settings.register_profile(
    "any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("any machine")

SHARED = Path(__file__).parent.parent.parent / "shared"


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of recordings and published figures beside the project."""
    if not SHARED.is_dir():
        pytest.skip(f"{SHARED.name}/ is not beside the project: no recordings to read")
    return SHARED
