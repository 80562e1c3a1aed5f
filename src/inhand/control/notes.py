"""What a reader should know of a controller that runs with a hand and an object."""

from inhand.control.catalogue import ControllerEntry
from inhand.control.names import FAMILY, LEARNED
from inhand.hands.files import assumed


def notes_of(entry: ControllerEntry, hand: str, spec: str) -> tuple[str, ...]:
    """Return what a reader should know of a controller's run with a hand and an object, a sentence each."""
    notes = assumed([hand])
    if entry.policy is None:
        return notes
    trained = {name: entry.policy.trained.get(name) for name in ("hand", "object")}
    if entry.policy.family is not None and entry.name == LEARNED:
        return (*notes, f"{LEARNED} moves {spec} with {hand} by the policy for hands and objects that differ, {FAMILY}")
    if entry.policy.family is not None or trained == {"hand": hand, "object": spec}:
        return notes
    other = "" if trained["hand"] == hand else f" {LEARNED} has a policy for hands and objects that differ."
    return (
        *notes,
        f"The policy {entry.name} was trained with {trained['object']} and {trained['hand']}; here it moves {spec} with"
        f" {hand}.{other}",
    )
