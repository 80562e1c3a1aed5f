"""A policy as a folder that travels: its weights, what says how to use them, and a card for people.

The card's first lines are those of a model on a hub. It tells what the policy is, what it sees and does, how it was
trained and what that took, and what it reached in an evaluation, with 95 % intervals.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from inhand.asterisk_test.robustness.summary import retention, wilson
from inhand.control.policy import CARD, Policy, save_policy
from inhand.control.policy_arrays import ACTOR
from inhand.control.trial import LOST
from inhand.errors import InputError
from inhand.folders import run_folder
from inhand.learning.evaluate import load_evaluation
from inhand.learning.report import Compared
from inhand.learning.run_cards import MARK
from inhand.pages import NOTHING, listed, page_of, table_of
from inhand.records import read_json
from inhand.repeats import NAME
from inhand.tasks.layouts import find_layout
from inhand.tasks.primitives import TRAIN
from inhand.versions import versions

if TYPE_CHECKING:
    from pandas import DataFrame

FINISHED = "finished.json"
"""What a training leaves of its cost."""
PAGE = "README.md"
TRUST = """## What to know before trusting it

All numbers are of simulations, whose servo gains, friction and contacts are partly guessed (docs/thesis.md of the
package). It is for"""
FRONT = """---
license: apache-2.0
library_name: inhand
pipeline_tag: robotics
tags: [in-hand-manipulation, asterisk-test, reinforcement-learning]
---"""


def write_policy(
    name: str, policy: Policy, source: Path, out: Path, results: Path | None = None, *, overwrite: bool = False
) -> None:
    """Write a policy's files and its card into a folder.

    Args:
        name: what it is called.
        policy: the policy.
        source: the folder of its training run, if it has one.
        out: the folder.
        results: the folder of its evaluation, for the card.
        overwrite: whether a policy that the folder holds may be replaced.

    Raises:
        InputError: an evaluation of another policy, or a folder that may not be written.
    """
    found = None if results is None else load_evaluation(results)
    if found is not None and found.trained != {**found.trained, **policy.trained}:
        raise InputError(f"--results {results} evaluates another policy than {source}: give its own evaluation")
    with run_folder(out, overwrite=overwrite, mark=NAME) as folder:
        save_policy(policy, folder)
        if (source / MARK).is_file():
            shutil.copyfile(source / MARK, folder / MARK)
        told = card(name, policy, _cost(source), found)
        (folder / PAGE).write_text(f"{FRONT}\n\n{told}", encoding="utf-8")


def card(name: str, policy: Policy, cost: dict[str, Any], found: Compared | None) -> str:
    """Return the card of a policy: what it is, what it saw, what it cost, what it reached."""
    layout, layers = find_layout(policy.observation), [*map(len, policy.weights), len(policy.biases[-1])]
    contract = policy.contract or policy.space
    parts = [[part.name, str(part.fixed), str(part.for_joint), str(part.for_finger)] for part in layout.parts]
    trained = [f"{key}: {value}" for key, value in policy.trained.items() if not isinstance(value, dict) and value]
    made = [f"{key}: {value}" for key, value in dict(policy.trained.get("versions") or {}).items()]
    sees = "encoders and a camera alone" if layout.sensed else "the simulation's true state"
    whom = "one hand" if policy.family is None else "hands of its family"
    driven = layout.sensed and policy.space is None
    drives = ", or `inhand.drive` for a hand outside the simulator" if driven else ""
    return page_of(
        f"# {name}: a policy that moves an object within the hand",
        f"A network of {' - '.join(map(str, layers))} numbers (ReLU, tanh at its end), run in NumPy. It sees {sees};"
        f" its actions are {policy.actions} of joint targets; the object is given to it in a {policy.grasp} grip.",
        f"Use it: `inhand evaluate FOLDER`, `inhand asterisk --controller FOLDER`{drives}. `{CARD}` says how to use the"
        f" weights of `{ACTOR}`; both are refused where the package's observations differ from those it learned with.",
        "" if contract is None else f"Decisions: {contract.rate_hz:g} a second. Joints: {', '.join(contract.joints)}.",
        table_of(("Part", "Numbers", "for each joint", "for each finger"), parts, "What it sees"),
        listed(trained, "What it was trained with"),
        listed([f"{key}: {value}" for key, value in cost.items()], "What the training took"),
        _results(found),
        f"{TRUST} {whom}, and for objects like those it learned with.",
        listed(made, "Versions it was made with"),
        f"Card written by inhand {versions()['inhand']}.",
    )


def _cost(folder: Path) -> dict[str, Any]:
    """Return what a training's folder tells of its cost; nothing of a policy alone."""
    file = folder / FINISHED
    told = read_json(file.read_bytes()) if file.is_file() else {}
    names = {
        "episodes": "episodes of the agent",
        "updates": "updates",
        "last_sitting_s": "time of the last sitting [s]",
    }
    return {text: told[key] for key, text in names.items() if isinstance(told, dict) and key in told}


def _results(found: Compared | None) -> str:
    if found is None:
        return "## Results\n\nNone stand here: `inhand evaluate`, then `inhand export --as policy --results FOLDER`."
    table, training = found.table(), {each.name for each in TRAIN}
    mine = table[table.controller == found.policy.name]
    learned = mine.direction.isin(training)
    groups = {"directions it learned": mine[learned], "directions it never saw": mine[~learned]}
    rows = [_row(words, chosen, found.config.seed) for words, chosen in groups.items() if len(chosen)]
    header = ("Trials in", "Trials", "Objects lost", "Share of the limit", "Overlap mean, largest [mm]", "Force [N]")
    world = found.policy.trials[0].passport
    told = (
        f"{world.object.name} with {world.hand.name}, engine {world.engine}, disturbed by {world.disturb}, seed"
        f" {found.config.seed}. Intervals hold 95 %: Wilson's of objects lost, by bootstrap over the trials of the"
        " share. The share of a lost object is 0. Overlap is that of links and object, force the largest of a finger."
    )
    return f"{table_of(header, rows, 'Results')}\n\n{told}"


def _row(words: str, rows: DataFrame, seed: int) -> tuple[str, ...]:
    lost = rows.outcome.isin(LOST)
    count, total = int(lost.sum()), len(rows)
    low, high = (100 * share for share in wilson(count, total))
    way = np.asarray(rows.fraction_of_limit.astype(float).where(~lost, 0.0), dtype=float)
    share, least, most = retention(way, np.ones(total), seed)
    reached = f"{share:.3f} [{least:.3f}, {most:.3f}]" if np.isfinite(share) else NOTHING
    return (
        words,
        str(total),
        f"{count} [{low:.1f} %, {high:.1f} %]",
        reached,
        f"{rows.penetration_mean_mm.mean():.2f}, {rows.penetration_max_mm.max():.2f}",
        f"{rows.force_max_n.max():.1f}",
    )
