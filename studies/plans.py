"""Plans the grasps that come with the package: of the standard hand and object, in every direction and turn.

    python studies/plans.py      rl and ik-sensed, some 150 s of a core each

Run it where the policy that ships, or a number of planning, has changed: a test tells.
"""

import logging
from pathlib import Path

import numpy as np

import inhand.policies
from inhand.control import shipped_plans
from inhand.control.catalogue import find_controller
from inhand.control.policy import load_policy
from inhand.control.run_config import HeldConfig
from inhand.control.sensed_plan import PLAN, Carrier, graded, plan_keys
from inhand.control.sensed_policy import carrier_of
from inhand.hands.files import load_hand, load_object
from inhand.hands.fit import Held
from inhand.tasks.paths import path_of, stacked, whole_path
from inhand.tasks.primitives import GROUPS, TURNS

PLACE = Path(inhand.policies.__file__).parent


def main() -> None:
    """Plan, and put the plans where they ship from."""
    for name, carrier in (("rl", carrier_of(load_policy(PLACE / "default"))), ("ik-sensed", graded(Carrier()))):
        plan(name, carrier)


def plan(name: str, carrier: Carrier) -> None:
    """Put the plans of a controller where they ship from."""
    config, entry = HeldConfig(), find_controller(name)
    held = Held(load_hand(config.hand), load_object(config.object))
    place = PLACE / shipped_plans.PLACE / f"{name}.npz"
    place.unlink(missing_ok=True)
    keys, rows = list[str](), list[dict[str, np.ndarray]]()
    for group in (GROUPS["all"], TURNS):
        poses = held.hand.start_pose + stacked([whole_path(path_of(each)) for each in group])
        keys += plan_keys(held, poses, carrier)
        grasp = entry.grasp(*held, poses)
        ways = np.stack([np.asarray(each.way) for each in getattr(grasp, "graded", ())], axis=1)
        rows.append({part: ways if part == "ways" else np.asarray(getattr(grasp, part)) for part in PLAN})
    shipped_plans.ship(place, keys, {part: np.concatenate([each[part] for each in rows]) for part in PLAN})
    logging.getLogger(__name__).info("%d paths in %s", len(keys), place)


if __name__ == "__main__":
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    main()
