"""The folder of a design study: its numbers, its figure, its page, and the winner's files."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from inhand.asterisk_test.design.asked import AIMS
from inhand.asterisk_test.design.browser import design_page
from inhand.asterisk_test.design.config import MARK, DesignConfig
from inhand.asterisk_test.design.figure import design_figure, label_of
from inhand.asterisk_test.design.finals import Final
from inhand.asterisk_test.design.found import Found
from inhand.asterisk_test.study import command, write_texts
from inhand.control.trial import write_json
from inhand.hands.hand import HandSpec
from inhand.hands.hand_text import write_hand
from inhand.pages import NOTHING, Part, again, counted, listed, page_of, table_of
from inhand.plots.save import save_picture
from inhand.shown import HTML, frame
from inhand.versions import versions

WINNER = "winner"
"""Folder and stem of the winner's files."""
SHOWN = 20
"""Hands of the front that the page has in a table; the CSV file has all."""


def rows(found: Found) -> list[dict[str, Any]]:
    """Return a row for each hand: what it is like, what its aims come to [mm], how far controllers carry [mm]."""
    front = {each.number for each in found.front}
    simulated = {final.looked.number: final for final in (*found.finals, found.known)}
    entries = []
    for each in (*found.catalogue, *found.looked):
        final, reach = simulated.get(each.number), each.table
        entry: dict[str, Any] = {
            "hand": each.hand.name,
            "catalogue": each.number < 1,
            **_measures(each.hand),
            **each.aims,
        }
        for spec, row, weights in zip(found.asked.objects, reach, found.asked.weights, strict=True):
            total = weights.sum()
            entry[f"reach_{spec.name}"] = float(row @ weights / total) if each.whole and total > 0 else None
        entry |= {"front": each.number in front, "given_up": not each.whole}
        entry |= {controller: final.means.get(controller) if final else None for controller in found.winner.fought}
        entries.append(entry | {"winner": each is found.winner.looked, "cannot_hold": "; ".join(each.reasons)})
    return entries


def _measures(hand: HandSpec) -> dict[str, Any]:
    sizes = {f"{name}_mm": 1e3 * getattr(hand, name) for name in ("palm_width", "link_width", "tip_length")}
    links = {
        f"{side}_links_mm": " + ".join(f"{1e3 * link:.1f}" for link in finger.links)
        for side, finger in zip(hand.finger_names, hand.fingers, strict=True)
    }
    return links | {name: round(size, 3) for name, size in sizes.items()}


def write_design(config: DesignConfig, found: Found, folder: Path, told: tuple[float, tuple[str, ...]]) -> None:
    """Write a study's numbers, figure, page and the winner's files into a folder; `told` is its time [s] and notes."""
    table = frame(rows(found))
    picture = save_picture(design_figure(found), folder, "design.png", "The front, hands to scale, gains and losses")
    write_hand(found.winner.looked.hand, folder / WINNER, WINNER)
    content = {
        "winner": _told(found.winner),
        "catalogue": _told(found.known),
        "tolerance_mm": found.off,
        "seconds": told[0],
        "notes": told[1],
        "config": asdict(config),
        "versions": versions(),
    }
    texts = {
        "hands.csv": table.to_csv(index=False, float_format="%.6g"),
        "report.md": page_of(*parts(config, found, [picture], told)),
        HTML: design_page(parts(config, found, [], told), config, found),
    }
    write_texts(texts, folder)
    write_json(content, folder / MARK)


def _told(final: Final) -> dict[str, Any]:
    """Return what the JSON tells of a hand in simulation."""
    return {
        "hand": final.looked.hand,
        "aims_mm": final.looked.aims,
        "reach_mm": final.looked.reach,
        "carried_mm": final.means,
        "kept": {name: sum(each.kept for each in fought) for name, fought in final.fought.items()},
    }


def answer(found: Found) -> list[str]:
    """Return the answer, a sentence each."""
    winner, known = found.winner, found.known
    ours, theirs = (found.asked.mean(each.looked.table) for each in (winner, known))
    lengths = [1e3 * sum(finger.length for finger in each.looked.hand.fingers) for each in (winner, known)]
    told = [
        f"Winner: {label_of(winner.looked.hand)}, mean reach {ours:.1f} mm with fingers of {lengths[0]:.1f} mm in all;"
        f" the best of the catalogue, {known.looked.hand.name}, {theirs:.1f} mm with {lengths[1]:.1f} mm:"
        f" {100 * (ours / theirs - 1):+.1f} %."
    ]
    for controller, mean in winner.means.items():
        if controller in known.means:
            share = f"{100 * (mean / known.means[controller] - 1):+.1f} %"
            kept = sum(each.kept for each in winner.fought[controller])
            total = sum(len(row) for each in winner.fought[controller] for row in each.distances)
            told.append(
                f"Controller {controller} carries objects {mean:.1f} mm with it and {known.means[controller]:.1f} mm"
                f" with that: {share}. It keeps the object in {kept} of {total} trials."
            )
    worst = min(found.off, key=lambda off: found.off[off])
    told.append(f"A little off, its mean reach is at least {found.off[worst]:.1f} mm ({worst or 'as it is'}).")
    return told


def simulated_row(found: Found, final: Final) -> list[str]:
    """Return the cells of a hand in simulation: its name, mean reach, and what each controller carries [mm]."""
    carried = [f"{final.means[name]:.1f}" if name in final.means else NOTHING for name in final.fought]
    return [label_of(final.looked.hand), f"{found.asked.mean(final.looked.table):.1f}", *carried]


def parts(
    config: DesignConfig, found: Found, pictures: Sequence[Part], told: tuple[float, tuple[str, ...]]
) -> list[Part]:
    """Return the parts of the page: what was asked, the answer, the figure, the tables, how to run it again."""
    aims = [AIMS[name].label for name in found.asked.aims]
    front = [
        [each.hand.name, *_measures(each.hand).values(), *(f"{each.aims[name]:.1f}" for name in found.asked.aims)]
        for each in found.front[:SHOWN]
    ]
    header = ["Hand", "Left links [mm]", "Right links [mm]", "Palm [mm]", "Link width [mm]", "Tip [mm]", *aims]
    simulated = [simulated_row(found, final) for final in (*found.finals, found.known)]
    nominal = found.off[""]
    off = [[name, f"{mean:.1f}", f"{100 * (mean / nominal - 1):+.1f} %"] for name, mean in found.off.items() if name]
    return [
        f"# Design: {counted(len(found.looked), 'hand')} for {', '.join(thing.name for thing in found.asked.objects)}",
        f"Aims: {', '.join(found.asked.aims)}. {counted(len(found.asked.primitives), 'direction')}, sampler"
        f" {config.sampler}, seed {config.seed}, {counted(config.seeds, 'seed')} in simulation.",
        listed([*answer(found), *told[1], f"This call took {told[0] / 60:.1f} minutes."]),
        *pictures,
        table_of(header, [[str(cell) for cell in row] for row in front], "The front"),
        table_of(
            ["Hand", "Mean reach [mm]", *(f"{name} [mm]" for name in config.controllers)], simulated, "In simulation"
        ),
        table_of(["What is off", "Mean reach [mm]", "Change"], off, "Tolerance of the winner"),
        f"The winner: `{WINNER}/{WINNER}.toml`, and as a robot `{WINNER}_urdf.toml` and `{WINNER}_mjcf.toml`.",
        again(command("design", config)),
    ]
