"""Recording as a function: what is to be shown in, a dataset of demonstrations out."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from inhand.control.catalogue import find_controller
from inhand.control.draws import check_draws, check_worlds
from inhand.control.loop import Told
from inhand.control.spatial_catalogue import refuse_of_space
from inhand.control.spatial_weight import check_carried
from inhand.control.user_policy import GraspKind
from inhand.errors import InputError
from inhand.folders import run_folder
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import check_fit
from inhand.hands.hand import HandSpec
from inhand.hands.objects import ObjectSpec
from inhand.hands.spatial.files import hand_name, is_spatial_hand, load_solid, load_spatial_hand, object_name
from inhand.hands.spatial.gravity import gravity_of
from inhand.hands.spatial.hand import SpatialHand
from inhand.hands.spatial.objects import SolidSpec
from inhand.hands.spatial.pair import SpatialPair
from inhand.learning.commands import RecordConfig
from inhand.learning.config import Training
from inhand.learning.dataset import Dataset, dataset_of, end_of
from inhand.learning.dataset_cards import CONTINUOUS, SPHERE, DatasetHead, PlanarHead, SpatialHead, kind_of
from inhand.learning.datasets import MARK, add_to, check_installed, end_dataset
from inhand.learning.demonstrations import Given, check_episodes, demonstrations, plans_of
from inhand.learning.environment_config import angles_of
from inhand.learning.experts import SHOWN_IN_SPACE, TEACHERS
from inhand.learning.half_recorded import STOPPED, go_on, save_begun
from inhand.learning.recipe import SEEN, AnyRecording, Recipe, Recording, SpatialRecording
from inhand.learning.space_pools import planned
from inhand.learning.starts import Noise
from inhand.learning.worlds import Interface
from inhand.records import compact, configured
from inhand.repeats import write_repeat
from inhand.shown import listed, path_of
from inhand.sim.disturbance import disturbance_of
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.engines import check_engine
from inhand.tasks.decisions import find_reward
from inhand.tasks.layouts import find_layout
from inhand.tasks.spatial.primitives import parse_spatial_directions
from inhand.versions import versions

DEFAULT = RecordConfig()
"""What is recorded where nothing else is asked for,"""
IN_PLANE = "train", "grip", 200
"""directions, observation and horizon with a hand in the plane,"""
IN_SPACE = "all,turns", "space", 180
"""and with one in space."""
DATASETS = Path("results/datasets")
"""Where the command leaves datasets, each to its id: a folder for MINARI_DATASETS_PATH."""


def record(
    hand: str | Path | HandSpec | SpatialHand = DEFAULT.hand,
    object: str | Path | ObjectSpec | SolidSpec = DEFAULT.object,
    *,
    directions: str | Sequence[str | float] | None = None,
    episodes: int = DEFAULT.episodes,
    seed: int = DEFAULT.seed,
    out: str | Path | None = None,
    **settings: Any,
) -> Dataset:
    """Record an expert's demonstrations and return them as a dataset.

    Args:
        hand: a name, a TOML file or a spec.
        object: a name, a TOML file or a spec.
        directions: words of the command line, names, or degrees counter-clockwise from +x; or continuous. None for
            train, and in space all and turns.
        episodes: how many.
        seed: of everything drawn.
        out: folder of the dataset; None for a temporary one.
        settings: other fields of `RecordConfig`, such as expert, observation, reward, push and engine.

    Raises:
        InputError: anything that cannot be recorded; the text says what, and what is allowed.
    """
    settings |= {"directions": directions and listed(directions), "episodes": episodes, "seed": seed}
    settings |= {"hand": hand_name(hand), "object": object_name(object)}
    settings |= disturbance_of(settings)
    settings["out"] = Path(tempfile.mkdtemp(prefix="inhand-record-")) if out is None else Path(path_of("out", out))
    return run_record(configured(RecordConfig, settings))


def run_record(config: RecordConfig, told: Told = lambda *_: None) -> Dataset:
    """Return the dataset of a configuration; `told` is told how far it is.

    One that was stopped goes on after the last batch that was written.

    Raises:
        InputError: anything in the configuration that cannot be recorded, or a folder that may not be written.
    """
    check_installed("`inhand record`")
    config = in_full(config)
    recording = recording_of(config)
    head = head_of(recording, config.directions or "", config.gravity or SPHERE)
    out = config.out or DATASETS / head.dataset_id
    words = compact({"head": head, "episodes": config.episodes})
    with run_folder(out, overwrite=config.overwrite, mark=MARK, stopped=STOPPED) as folder:
        begun, storage = go_on(folder, head, words, environment_spec(recording, config))
        given = _given(recording, told)
        for batch in demonstrations(recording, given, begun.rng, told, begun.before):
            episodes = list(batch.apart())
            add_to(storage, episodes, head.kind)
            begun = replace(begun, ends=[*begun.ends, *map(end_of, episodes)], kept=batch.midway)
            save_begun(begun, folder, words)
        end_dataset(folder)
        write_repeat(folder, "record", replace(config, out=out))
        (folder / STOPPED).unlink()
    return dataset_of(out, head, begun.ends)


def in_full(config: RecordConfig) -> RecordConfig:
    """Return a configuration with what follows from the hand where nothing is said."""
    directions, observation, horizon = IN_SPACE if is_spatial_hand(config.hand) else IN_PLANE
    return replace(
        config,
        directions=directions if config.directions is None else config.directions,
        observation=observation if config.observation is None else config.observation,
        horizon=horizon if config.horizon is None else config.horizon,
    )


def _given(recording: AnyRecording, told: Told) -> Given:
    """Return the grasps of a recording, planned."""
    return planned(recording, told) if isinstance(recording, SpatialRecording) else plans_of(recording, told=told)


def recording_of(config: RecordConfig) -> AnyRecording:
    """Return what is to be recorded by a configuration in full.

    Raises:
        InputError: anything in the configuration that cannot be recorded.
    """
    config = in_full(config)
    check_episodes(config.episodes, f"--episodes {config.episodes}")
    if config.horizon is not None and config.horizon < 1:
        raise InputError(f"--horizon {config.horizon}: give at least 1")
    check_draws(config)
    for name in ("push", "grip_spread"):
        if getattr(config, name) < 0:
            raise InputError(f"--{name.replace('_', '-')} {getattr(config, name):g}: give 0 or more")
    for name in ("midway", "whole"):
        if not 0 <= getattr(config, name) <= 1:
            raise InputError(f"--{name} {getattr(config, name):g}: a share is from 0 to 1")
    _check_layout(config)
    find_reward(config.reward)
    return _in_space(config) if is_spatial_hand(config.hand) else _in_plane(config)


def _check_layout(config: RecordConfig) -> None:
    """Refuse a layout of observations that no dataset has, or none of such a hand."""
    layout = find_layout(config.observation or "")
    if layout.columns:
        raise InputError(
            f"--observation {config.observation} has slots for joints that a hand has not, which no dataset has: take"
            " grip; inhand train --preset family records its own demonstrations"
        )
    space = is_spatial_hand(config.hand)
    if layout.space != space:
        where, told = ("space", "space, space-senses") if space else ("the plane", "grip, grip-open, senses")
        told += " or space-thesis" if space else " or thesis"
        raise InputError(f"--observation {config.observation} with {config.hand}, a hand in {where}: take {told}")


def _in_plane(config: RecordConfig) -> Recording:
    refuse_of_space(config.hand, config.gravity)
    if config.expert not in TEACHERS:
        find_controller(config.expert)
    hand, thing = load_hand(config.hand), load_object(config.object)
    check_fit(hand, thing)
    check_engine(config.engine)
    continuous = config.directions == CONTINUOUS
    return Recording(
        hand,
        thing,
        angles_of("train" if continuous else config.directions or ""),
        _recipe(config),
        _interface(config),
        _noise(config),
        config.seed,
        config.engine,
        continuous=continuous,
        disturb=load_disturbance(config.disturb),
    )


def _in_space(config: RecordConfig) -> SpatialRecording:
    if config.expert not in SHOWN_IN_SPACE:
        known = " or ".join(SHOWN_IN_SPACE)
        raise InputError(f"--expert {config.expert} with {config.hand}, a hand in space: take {known}")
    held = SpatialPair(load_spatial_hand(config.hand), load_solid(config.object))
    check_carried(*held, config.engine)
    check_worlds(config, *held)
    continuous = config.directions == CONTINUOUS
    primitives = SEEN if continuous else parse_spatial_directions(config.directions or "")
    holding = [each.name for each in primitives if each.direction is not None and any(each.rotation)]
    if holding:
        raise InputError(f"--directions {', '.join(holding)} hold a rotation: an episode moves an object or turns it")
    word = config.gravity or SPHERE
    return SpatialRecording(
        held,
        primitives,
        _recipe(config),
        _interface(config),
        _noise(config),
        config.seed,
        Training.drawn * continuous,
        gravity=None if word == SPHERE else gravity_of(word),
        disturb=load_disturbance(config.disturb),
    )


def _recipe(config: RecordConfig) -> Recipe:
    grasp: GraspKind = "rough" if config.expert == "thesis-ik" else "planned"
    return Recipe(config.episodes, config.expert, config.push, config.midway, grasp, config.whole, config.grip_spread)


def _interface(config: RecordConfig) -> Interface:
    return Interface(config.observation or "", config.actions, config.reward, config.horizon or 1)


def _noise(config: RecordConfig) -> Noise:
    return Noise(config.noise_mm / 1e3, float(np.deg2rad(config.noise_deg)))


def head_of(recording: AnyRecording, directions: str, gravity: str = SPHERE) -> DatasetHead:
    """Return the head of a recording's dataset, with the words that directions and gravity were asked for by."""
    recipe, noise = recording.recipe, recording.noise
    told = (
        recipe.expert,
        recipe.grasp,
        recording.interface.reward,
        directions,
        (noise.position, noise.rotation),
        recipe.push,
        recipe.midway,
        recipe.whole,
        recipe.grip_spread,
        recording.seed,
        versions(),
        recording.engine,
        recording.disturb,
    )
    if isinstance(recording, SpatialRecording):
        return SpatialHead(kind_of(recording.hand, recording.interface), recording.object, *told, gravity)
    return PlanarHead(kind_of(recording.hand, recording.interface), recording.object, *told)


def environment_spec(recording: AnyRecording, config: RecordConfig) -> str | None:
    """Return the JSON of the environment in which the demonstrations are a controller's episodes.

    None where there is none: of a hand in space on senses, or in worlds that differ.
    """
    import gymnasium

    config = in_full(config)
    same = ["hand", "object", "observation", "actions", "reward", "horizon", "noise_mm", "noise_deg"]
    told = {name: getattr(config, name) for name in same} | {"directions": config.directions, "stop": True}
    if isinstance(recording, SpatialRecording):
        if recording.disturb is not None or find_layout(recording.interface.observation).sensed:
            return None
        told |= {"gravity": config.gravity or SPHERE}
        told |= {"directions": "all,turns"} if config.directions == CONTINUOUS else {}
    else:
        told |= {"directions": "all"} if recording.continuous else {}
        told |= {} if recording.disturb is None else {"disturb": config.disturb}
        told |= {"engine": config.engine, "grasp": recording.recipe.grasp}
    name = "SpatialAsterisk" if isinstance(recording, SpatialRecording) else "Asterisk"
    spec = deepcopy(gymnasium.spec(f"inhand/{name}-v0"))
    spec.kwargs = told
    return str(spec.to_json())
