"""Plans the grasps that come with the package: of the standard hands and objects, in every direction and turn.

    python studies/plans.py      half an hour of a core, most of it for rl in the plane and in space

Run it where a policy that ships, or a number of planning, has changed: tests tell.
"""

import logging
from collections.abc import Iterable
from functools import partial
from pathlib import Path

import numpy as np

import inhand.policies
from inhand.control import shipped_plans
from inhand.control.catalogue import find_controller
from inhand.control.feeling import carrier_of
from inhand.control.loop import Bench
from inhand.control.phases import GradedGrasp, Grasp
from inhand.control.policy import load_policy
from inhand.control.run_config import HeldConfig
from inhand.control.sensed_plan import Carrier, graded, plan_keys
from inhand.control.spatial_catalogue import find_spatial_controller
from inhand.control.spatial_sensed_plan import carrier_in_space, plan_keys_in_space
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.hands.spatial.gravity import PALMS, gravity_of
from inhand.hands.spatial.names import STANDARD
from inhand.hands.spatial.pair import SpatialPair, load_held
from inhand.sim.names import SPATIAL
from inhand.tasks.paths import path_of, stacked, whole_path
from inhand.tasks.primitives import GROUPS, TURNS
from inhand.tasks.spatial.paths import spatial_path_of
from inhand.tasks.spatial.primitives import DIRECTIONS
from inhand.tasks.spatial.primitives import TURNS as SPATIAL_TURNS

PLACE = Path(inhand.policies.__file__).parent
Planned = tuple[list[str], dict[str, np.ndarray]]
"""Keys of plans, and the plans by name, `(P, ...)`."""


def main() -> None:
    """Plan, and put the plans where they ship from."""
    for name, carrier in (("rl", carrier_of(load_policy(PLACE / "default"))), ("ik-sensed", graded(Carrier()))):
        ship(name, partial(in_plane, name, carrier))
    ship("rl-in-space", partial(in_space, "rl", carrier_in_space(load_policy(PLACE / "spatial"))))


def ship(name: str, planned: "partial[Iterable[Planned]]") -> None:
    """Put plans where they ship from, made without those that are there."""
    place = PLACE / shipped_plans.PLACE / f"{name}.npz"
    place.unlink(missing_ok=True)
    keys, plans = list[str](), list[dict[str, np.ndarray]]()
    for some, rows in planned():
        keys += some
        plans.append(rows)
    shipped_plans.ship(place, keys, {part: np.concatenate([each[part] for each in plans]) for part in plans[0]})
    logging.getLogger(__name__).info("%d paths in %s", len(keys), place)


def in_plane(name: str, carrier: Carrier) -> Iterable[Planned]:
    """Give the plans of a controller in the plane, of directions and of turns."""
    config, entry = HeldConfig(), find_controller(name)
    held = Held(load_hand(config.hand), load_object(config.object))
    for group in (GROUPS["all"], TURNS):
        poses = held.hand.start_pose + stacked([whole_path(path_of(each)) for each in group])
        yield plan_keys(held, poses, carrier), rows_of(entry.grasp(*held, poses))


def in_space(name: str, carrier: Carrier) -> Iterable[Planned]:
    """Give those of a controller in space under each palm, all directions and turns."""
    held, paths = load_held(STANDARD, "cube_50"), [spatial_path_of(each) for each in (*DIRECTIONS, *SPATIAL_TURNS)]
    if not isinstance(held, SpatialPair):
        raise TypeError(f"{STANDARD} is in the plane")
    starts, bench = np.tile(held.hand.start_pose, (len(paths), 1)), Bench(SPATIAL)
    for palm in PALMS:
        gravity = np.array([gravity_of(palm)])
        pulls = np.tile(gravity, (len(paths), 1))
        grasp = find_spatial_controller(name).grasp(*held, paths, pulls, starts, bench=bench)
        yield plan_keys_in_space(held, paths, gravity, carrier), rows_of(grasp)


def rows_of(grasp: Grasp) -> dict[str, np.ndarray]:
    """Return what is kept of planned grasps, `(P, ...)` by name."""
    each = grasp.graded if isinstance(grasp, GradedGrasp) else (grasp,)
    rows = {name: array for name, array in vars(grasp).items() if isinstance(array, np.ndarray)}
    if "risk" in rows:
        rows["risks"] = np.stack([np.asarray(one.risk) for one in each], axis=-1)
        del rows["risk"]
    return rows | {"ways": np.stack([np.asarray(one.way) for one in each], axis=-1)}


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    main()
