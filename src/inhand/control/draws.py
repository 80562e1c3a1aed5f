"""Start noise: where each trial's object really stands."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from inhand.errors import InputError


class Draws(Protocol):
    """Settings that starts are drawn by."""

    @property
    def noise_mm(self) -> float:
        """Standard deviation in x and y [mm]."""

    @property
    def noise_deg(self) -> float:
        """Standard deviation of the rotation [deg]."""

    @property
    def seed(self) -> int:
        """Seed of the noise."""


def check_draws(config: Draws) -> None:
    """Refuse start noise or a seed that nothing can be drawn with.

    Raises:
        InputError: the text names the option.
    """
    for name, value in (("--noise-mm", config.noise_mm), ("--noise-deg", config.noise_deg)):
        if not (np.isfinite(value) and value >= 0):
            raise InputError(f"{name} {value:g}: noise must be 0 or more")
    if config.seed < 0:
        raise InputError(f"--seed {config.seed}: a seed is 0 or more")
