"""Fixtures shared by the tests."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def asterisk_data() -> Path:
    """Return the folder of recorded human trials, which lies beside the repository and is not part of it."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "asterisk-data"
    if not folder.is_dir():
        pytest.skip("the recorded human trials (shared/asterisk-data beside the repository) are not here")
    return folder
