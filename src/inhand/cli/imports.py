"""`inhand import`: demonstrations in another form as a dataset to learn from."""

from inhand.cli.answer import Answer
from inhand.cli.commands import ImportConfig
from inhand.errors import InputError


def run_import(config: ImportConfig) -> Answer:
    """Read, look at the layout, write, and say how to learn from it."""
    if not config.dataset.is_dir():
        raise InputError(f"{config.dataset} is not there: give the folder of a LeRobotDataset or a Minari dataset")
    from inhand.learning.travel import import_demonstrations

    count = import_demonstrations(config.dataset, config.out, config.like, overwrite=config.overwrite)
    learn = f"Learn from it: inhand train --demonstrations {config.out}"
    return Answer(sentences=(f"{count} episodes: {config.out}", learn), out=config.out)
