"""Presets of training: functions that return one configuration each, and what they are with a hand in space."""

from dataclasses import replace
from pathlib import Path

from inhand.errors import InputError
from inhand.hands.spatial.files import is_spatial_hand
from inhand.learning.config import Learning, Training
from inhand.learning.recipe import Recipe
from inhand.learning.worlds import Interface
from inhand.sim.names import SPATIAL


def thesis() -> Training:
    """Return the thesis's training (3.3.4); what it leaves open is numbered in docs/thesis.md."""
    return Training(
        "thesis",
        interface=Interface("thesis", "angles", "thesis", horizon=150),
        recipe=Recipe(episodes=5000, push=0.0, midway=0.0, grasp="rough"),
        learning=Learning(reward_scale=0.01, follow=1e-4),
        updates=250,
        expert_share=0.5,
        spread=0.02,
    )


def default() -> Training:
    """Return the training of a controller on real senses, in worlds that differ (docs/learning.md)."""
    base = privileged()
    return replace(
        base,
        preset="default",
        disturb="field",
        interface=Interface("senses", "steps", "progress", horizon=180, truth="truth"),
        recipe=Recipe(1536, "mild-teacher", 0.012, 0.25, "sensed", whole=0.5, grip_spread=8.0, turns=0.15, legs=0.35),
        imitate=10000,
        rounds=4,
        episodes=250,
        learning=replace(base.learning, imitation=4.0),
    )


def privileged() -> Training:
    """Return the training that goes farthest, on perfect knowledge; docs/learning.md argues what the thesis has not."""
    return Training(
        "privileged",
        directions="continuous",
        interface=Interface("grip", "steps", "progress", horizon=200),
        recipe=Recipe(episodes=2048, push=0.01, midway=0.5, whole=0.5, grip_spread=60.0),
        learning=Learning(
            critics=2,
            critic_rate=3e-4,
            weight_decay=1e-5,
            discount=0.99,
            batch=128,
            smoothing=0.1,
            actor_every=2,
            imitation=2.0,
            value_weight=0.3,
        ),
        imitate=12000,
        warm_up=3000,
        episodes=600,
        worlds=128,
        decisions=20,
        updates=250,
        expert_share=0.5,
        share_kept=1.0,
        evaluate_every=50,
    )


def family() -> Training:
    """Return the training of one controller on real senses for every hand and object of a family (docs/family.md)."""
    base = default()
    return replace(
        base,
        preset="family",
        pairs=96,
        interface=replace(base.interface, observation="joint-senses", truth="joints"),
        recipe=replace(base.recipe, expert="soft-teacher", turns=0.0, legs=0.0),
        imitate=6000,
        rounds=3,
        refit=3000,
        learning=replace(base.learning, network="joints", hidden=(64, 64)),
    )


def privileged_family() -> Training:
    """Return the same on perfect knowledge, which goes farther."""
    return replace(
        family(),
        preset="family-privileged",
        disturb="none",
        interface=Interface("joints", "steps", "progress", horizon=180),
        recipe=Recipe(1536, "teacher", push=0.012, midway=0.25, whole=0.5, grip_spread=60.0),
    )


def with_space(base: Training) -> Training:
    """Return a training with the standard hand in space and its cube."""
    return replace(base, hand="3f_60.60_40_10", object="cube_50", engine=SPATIAL)


def spatial() -> Training:
    """Return the training of one controller on real senses for a hand in space, by imitation (docs/spatial.md)."""
    base = replace(privileged_spatial(), preset="spatial", disturb="field", imitate=12000, rounds=4)
    senses = replace(base.interface, observation="space-senses", truth="space-truth")
    recipe = replace(base.recipe, push=0.012, grasp="sensed", palms=0.6)
    wide = replace(base.learning, hidden=(256, 256))
    return replace(base, interface=senses, recipe=recipe, learning=wide, warm_up=0, episodes=0)


def privileged_spatial() -> Training:
    """Return that of one controller for all directions and turns of a hand in space (docs/spatial.md)."""
    base = with_space(privileged())
    return replace(
        base,
        preset="spatial-privileged",
        interface=Interface("space", "steps", "progress", horizon=180),
        recipe=Recipe(1536, "teacher", push=0.01, midway=0.25, whole=0.5, grip_spread=15.0),
        imitate=8000,
        rounds=3,
        warm_up=2000,
        episodes=250,
        trials=1,
        learning=replace(base.learning, imitation=4.0),
    )


def hand_of_family(given: Training | None = None) -> Training:
    """Return the training that fits a policy of the family to one hand and object, from few demonstrations."""
    base = given or family()
    return replace(
        base,
        preset="from-family",
        pairs=0,
        start="rl-family",
        recipe=replace(base.recipe, episodes=64, midway=0.0),
        learning=replace(base.learning, imitation_rate=2e-5),
        imitate=1000,
        refit=1000,
        rounds=1,
        relabelled=64,
        warm_up=0,
        updates=1,
        decisions=180,
        episodes=1,
        worlds=1,
        trials=4,
    )


def smoke() -> Training:
    """Return a training of seconds that goes through every part and learns little."""
    return Training(
        "smoke",
        interface=Interface("grip", "steps", "progress", horizon=25),
        recipe=Recipe(episodes=32, push=0.01, midway=0.0, grasp="rough"),
        learning=Learning(hidden=(16, 16), batch=16, imitation=1.0, reward_scale=0.01, follow=1e-4),
        imitate=2000,
        warm_up=1000,
        episodes=60,
        worlds=10,
        decisions=8,
        updates=20,
        expert_share=0.5,
        spread=0.02,
        evaluate_every=30,
        trials=1,
    )


def spatial_thesis() -> Training:
    """Return the thesis's training with a hand in space: table 3.1 and 3.3 as far as they have a meaning there."""
    base = thesis()
    interface, recipe = replace(base.interface, observation="space-thesis"), replace(base.recipe, grasp="planned")
    return replace(with_space(base), drawn=0, interface=interface, recipe=recipe, trials=1)


def spatial_smoke() -> Training:
    """Return a training of a hand in space that goes through every part and learns little."""
    base = smoke()
    interface, recipe = replace(base.interface, observation="space"), replace(base.recipe, grasp="planned")
    return replace(with_space(base), drawn=0, interface=interface, recipe=replace(recipe, expert="teacher"))


PRESETS = {
    "default": default,
    "privileged": privileged,
    "family": family,
    "family-privileged": privileged_family,
    "from-family": hand_of_family,
    "spatial": spatial,
    "spatial-privileged": privileged_spatial,
    "thesis": thesis,
    "smoke": smoke,
}
"""Presets by name."""
IN_SPACE = PRESETS | {
    "default": spatial,
    "privileged": privileged_spatial,
    "thesis": spatial_thesis,
    "smoke": spatial_smoke,
}
"""What they are where a hand in space is asked for."""


def preset(name: str, hand: str | Path | None = None) -> Training:
    """Return a preset by name, as it is with a hand.

    Raises:
        InputError: there is none of that name, or a hand file that cannot be read.
    """
    if name not in PRESETS:
        was = "; what was sensed is default now, and what was default is privileged" if name == "sensed" else ""
        raise InputError(f"unknown preset {name!r}; allowed are {', '.join(PRESETS)}{was}")
    return (PRESETS if hand is None or not is_spatial_hand(hand) else IN_SPACE)[name]()
