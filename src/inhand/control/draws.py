"""Start noise: where each trial's object really stands."""

from collections.abc import Iterable, Sequence

import numpy as np

from inhand.control.contract import AnyContract, other_senses
from inhand.control.run_config import RunConfig
from inhand.errors import InputError
from inhand.geometry import Array
from inhand.sim.disturbance import Differences, told
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.drawn import Disturbed, H, Key, S, check_drawn, draw

STEP_DEG = 1e-3
"""Directions and rotations nearer than this to each other are one, and start alike [deg]."""
AROUND = round(360 / STEP_DEG)
"""Steps of a whole turn, after which directions repeat; it stands for no direction."""
MOST_TRIALS = 10_000
"""Trials of a run at most: about 5 GB and a quarter of an hour of one core."""
TRIAL_MB, TRIAL_S = 0.5, 0.1
"""What a trial takes of memory [MB] and of one core [s]: guessed, from shorter trials that were measured."""


def check_count(count: int, given: str) -> None:
    """Refuse more trials than one run can hold; the text says `given`, what was asked for.

    Raises:
        InputError: the text tells the memory and the time that they would take, and what can be run.
    """
    if count > MOST_TRIALS:
        raise InputError(
            f"{given}: {count} trials would take about {count * TRIAL_MB / 1e3:.0f} GB of memory and"
            f" {count * TRIAL_S / 3600:.0f} hours of one core; a run holds at most {MOST_TRIALS}: give fewer, or split"
            " them over runs with another --seed each"
        )


def check_draws(config: RunConfig) -> None:
    """Refuse start noise, a seed or a disturbance that nothing can be drawn with.

    Raises:
        InputError: the text names the option.
    """
    load_disturbance(config.disturb)
    for name, value in (("--noise-mm", config.noise_mm), ("--noise-deg", config.noise_deg)):
        if value < 0:
            raise InputError(f"{name} {value:g}: noise must be 0 or more")
    if config.seed < 0:
        raise InputError(f"--seed {config.seed}: a seed is 0 or more")


def check_worlds(config: RunConfig, hand: H, spec: S) -> None:
    """Refuse a disturbance at whose ends a hand or an object is not one that can be.

    Raises:
        InputError: the text names the disturbance and what cannot be.
    """
    disturbance = load_disturbance(config.disturb)
    if disturbance is not None:
        check_drawn(disturbance, hand, spec)


def start_noise(config: RunConfig, whose: Iterable[tuple[float | None, float, int]]) -> Array:
    """Return how far each object's start is from where it should be `(B, 3)` [m, m, rad].

    It follows from the seed, the direction [deg] (None where there is none), the rotation [deg] and the trial's number
    alone. So the same trial starts alike whatever runs beside it, and runs of other hands, objects and controllers are
    paired with it.
    """
    spread = np.array([config.noise_mm / 1e3, config.noise_mm / 1e3, np.deg2rad(config.noise_deg)])
    return np.array(spread * [np.random.default_rng(key).standard_normal(3) for key in keys_of(config, whose)])


def start_noise_in_space(
    config: RunConfig, trials: Sequence[int], goals: Sequence[Sequence[float]] | None = None
) -> tuple[Array, Array]:
    """Return how far each object's start is moved [m] and turned [rad] from where it should be, `(B, 3)` each.

    It follows from the seed, the trial's number and numbers that tell its primitive, if it has one, so that runs of
    other hands, objects and gravities are paired with it.
    """
    keys = keys_in_space(config, trials, goals)
    moved, turned = np.stack([np.random.default_rng(key).standard_normal((2, 3)) for key in keys], axis=1)
    return config.noise_mm / 1e3 * moved, np.deg2rad(config.noise_deg) * turned


def keys_of(config: RunConfig, whose: Iterable[tuple[float | None, float, int]]) -> list[Key]:
    """Return what the draws of each trial follow from: seed, number, direction [deg] and rotation [deg]."""
    return [(config.seed, trial, *_numbers(angle, rotation)) for angle, rotation, trial in whose]


def keys_in_space(
    config: RunConfig, trials: Sequence[int], goals: Sequence[Sequence[float]] | None = None
) -> list[Key]:
    """Return the same in space: seed, number, and numbers that tell the primitive, if there is one."""
    told = zip(trials, goals or [()] * len(trials), strict=True)
    # A seed takes no negative number.
    return [(config.seed, trial, *(round(1e6 * part) % 2**32 for part in goal)) for trial, goal in told]


def disturbed_worlds(
    config: RunConfig, keys: Iterable[Key], n_joints: int, *, space: bool = False
) -> tuple[Disturbed, ...] | None:
    """Return how each trial's world is disturbed, with a hand of some joints; None where a run disturbs nothing.

    It follows from the same keys as the start noise, of which it is independent, and from the disturbance.

    Raises:
        InputError: no such disturbance.
    """
    spec = load_disturbance(config.disturb)
    return None if spec is None else tuple(draw(spec, key, n_joints, space=space) for key in keys)


def disturbance_notes(
    config: RunConfig, reads: str, contract: AnyContract | None = None, *, space: bool = False
) -> tuple[str, ...]:
    """Return what a reader should know of a disturbed run, a sentence each; nothing of another.

    Its controller reads so, and learned by a contract if it did.
    """
    spec = load_disturbance(config.disturb)
    if spec is None:
        return ()
    notes: tuple[str, ...] = (
        f"Disturbed by {told(spec)}. The controller is told none of it; it reads what is {reads}.",
    )
    if space and spec.differs.floor != Differences.floor:
        notes += ("In space there is no floor: differs.floor has no effect.",)
    others = () if contract is None else tuple(other_senses(contract, spec))
    return (*notes, f"The policy was trained with other senses: {'; '.join(others)}.") if others else notes


def _numbers(angle_deg: float | None, rotation_deg: float) -> tuple[int, int]:
    """Return whole numbers that stand for a direction and a rotation in a seed."""
    angle = AROUND if angle_deg is None else round(angle_deg / STEP_DEG) % AROUND
    return angle, round(rotation_deg / STEP_DEG) % 2**32  # a seed takes no negative number
