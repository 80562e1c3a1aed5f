"""`inhand design`: which hand suits a job."""

from contextlib import ExitStack

from inhand.aside import second_process
from inhand.asterisk_test.design import run
from inhand.asterisk_test.design.config import DesignConfig
from inhand.asterisk_test.design.finals import compile_aside
from inhand.cli.answer import Answer, Listing, of_run
from inhand.cli.terminal import progress, say

SPEED_OVER_S = 3600.0
"""The time left is told from what was done in the last hour [s]."""


def run_design(config: DesignConfig) -> Answer:
    """Search, write everything into the folder, and return the answer."""
    done: dict[str, tuple[int, int]] = {}
    with ExitStack() as begun, progress(spoken=True, over_s=SPEED_OVER_S) as tell:

        def told(what: str, part: str, count: int, total: int) -> None:
            done[what] = count, total
            tell(f"{what}, {part}", count, total)

        def ready() -> None:
            compile_aside(begun.enter_context(second_process("inhand.asterisk_test.design.finals")), config.engine)

        try:
            found = run.run_design(config, told, ready)
        except KeyboardInterrupt:
            counts = ", ".join(f"{count} of {total} {what}" for what, (count, total) in done.items()) or "nothing"
            say(f"Done so far: {counts}. The same command goes on from there")
            raise
    found.save(config.out)
    from inhand.asterisk_test.design import page

    hands = (*found.found.finals, found.found.known)
    cells = [page.simulated_row(found.found, final) for final in hands]
    header = "Hand", "Mean reach [mm]", *(f"{name} [mm]" for name in config.controllers)
    report = f"Report: {config.out / 'report.html'}; the winner: {config.out / page.WINNER}"
    sentences = (*page.answer(found.found), *found.notes, report)
    return of_run(found, config.out, [Listing("The best", header, cells)], sentences)
