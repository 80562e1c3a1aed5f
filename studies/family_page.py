"""The folder of the study: `family.json`, `cases.csv`, the heat map and the page."""

from __future__ import annotations

from dataclasses import asdict

import pandas as pd

import family_study as study
from family_config import FamilyConfig
from inhand.asterisk_test.study import write_texts
from inhand.control.trial import write_json
from inhand.pages import Picture, again, listed, page_of, table_of
from inhand.plots.heatmap import HeatMap, heatmap_figure
from inhand.plots.save import save_picture
from inhand.versions import versions

HEADER = ("", "Cases", "Lost", "Kept", "Expert keeps", "Share of the expert", "Median", "Turns")
"""Columns of hands and of objects."""
Found = tuple[pd.DataFrame, pd.DataFrame | None, pd.DataFrame]
"""All cases, those of the standard pair with the policy trained alone beside, and few demonstrations."""


def write_family(config: FamilyConfig, found: Found, words: str, seconds: float) -> None:
    """Write numbers, heat map and page of a finished study."""
    cases, alone, few = found
    hands, objects, share, lost = study.shares(cases)
    heat = heatmap_figure(HeatMap(hands, objects, share, lost), "Share", TITLE, "mean over the directions")
    picture = save_picture(heat, config.out, "share.png", TITLE)
    total = study.overall(cases)
    content = {
        **total,
        "standard": None if alone is None else alone.to_dict("records"),
        "new": few.to_dict("records"),
        "config": asdict(config) | {"out": str(config.out)},
        "versions": versions(),
        "seconds": seconds,
    }
    write_json(content, config.out / "family.json")
    write_texts(
        {"cases.csv": cases.to_csv(index=False), "report.md": _page(config, found, total, picture, words)}, config.out
    )


TITLE = "Share of what each hand's own expert reaches"


def _page(config: FamilyConfig, found: Found, total: dict[str, float], picture: Picture, words: str) -> str:
    cases, alone, few = found
    lost = cases[~cases.kept]
    return page_of(
        f"# {config.policy} with {len(config.hands)} hands and {len(config.objects)} objects that it never saw",
        listed(_sentences(total, alone)),
        picture,
        table_of(HEADER, rows_of(study.by_hand(cases)), "Hands"),
        table_of(HEADER, rows_of(study.by_object(cases)), "Objects"),
        table_of(
            ("Hand", "Demonstrations", "Share of the expert", "Kept"),
            [
                (str(row["hand"]), str(row["demonstrations"]), f"{row['share']:.3f}", f"{100 * row['kept']:.0f} %")
                for row in few.to_dict("records")
            ],
            "A new hand",
        )
        if len(few)
        else "",
        listed(
            [
                f"{row['hand']} with {row['object']}, {row['direction']}: {row['why']}, after {row['reached']:.0f}"
                for row in lost.to_dict("records")
            ],
            "What failed",
            "Every case kept the object to its end.",
        ),
        again(words),
    )


def _sentences(total: dict[str, float], alone: pd.DataFrame | None) -> list[str]:
    said = [
        f"Lost {100 * total['lost']:.1f} % of the cases, kept {100 * total['kept']:.1f} %: the rest did not move. Each"
        f" hand's expert, undisturbed, keeps {100 * total['expert_kept']:.1f} %.",
        f"Mean share of each hand's own expert {total['share']:.3f}, of the worst hand {total['worst_hand']:.3f}.",
        f"Turns: share {total['turns']:.3f}, lost {100 * total['turns_lost']:.1f} %.",
    ]
    if alone is not None:
        mine, its = alone.reached.mean(), alone.reached_alone.mean()
        said.append(
            f"The standard pair: {mine:.1f} mm on the mean; the policy trained with it alone {its:.1f} mm, the expert"
            f" {alone.expert.mean():.1f} mm: shares {mine / alone.expert.mean():.3f} and"
            f" {its / alone.expert.mean():.3f}."
        )
    return said


def rows_of(found: pd.DataFrame) -> list[tuple[str, ...]]:
    """Return the rows under `HEADER`."""
    return [
        (
            str(name),
            f"{row.cases:.0f}",
            f"{row.lost:.0f}",
            f"{100 * row.kept:.1f} %",
            f"{100 * row.expert_kept:.1f} %",
            f"{row.share:.3f}",
            f"{row['median']:.3f}",
            f"{row.turns:.3f}",
        )
        for name, row in found.iterrows()
    ]
