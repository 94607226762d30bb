"""The version that is stated is the one that is installed."""

from importlib.metadata import version

from fieldcal.core.version import __version__


def test_the_version_stated_is_that_of_the_package() -> None:
    assert __version__ == version("fieldcal")
