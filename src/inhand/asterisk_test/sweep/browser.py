"""The page of a sweep for a browser: heat maps, tables that sort, objects that were lost."""

from collections.abc import Sequence
from pathlib import Path

from inhand.asterisk_test.browser import lost_replays
from inhand.asterisk_test.cells import kept_lost
from inhand.asterisk_test.sweep.config import SweepConfig
from inhand.asterisk_test.sweep.summary import Sweep
from inhand.pages import Part
from inhand.plots.heatmap import HeatMap
from inhand.plots.page.charts import Heats, heat_of
from inhand.plots.page.document import html_of, settings_of
from inhand.plots.page.views import View


def sweep_page(
    parts: Sequence[Part], maps: Sequence[tuple[HeatMap, str, str]], sweep: Sweep, config: SweepConfig, cells: Path
) -> str:
    """Return the page of a sweep.

    Args:
        parts: of its page, the figures left out.
        maps: heat maps, each with its title and what it tells.
        sweep: what was found.
        config: of the sweep.
        cells: the folder of its cells.
    """
    title, intro, answer, explained, *told = parts
    heats = Heats(tuple(heat_of(*each) for each in maps))
    pairs = [(hand, thing) for hand in sweep.hands for thing in sweep.objects]
    lost = [(f"{hand} with {thing}", kept_lost(cells, hand, thing)) for hand, thing in pairs]
    found = [View("heat", heats, "Heat maps", str(explained)), *told[:-1], *lost_replays(lost), told[-1]]
    return html_of("A sweep", [title, intro, answer, *found, settings_of(config)])
