"""`inhand export`: a policy for other runtimes or with its card, trials and demonstrations for other programs."""

from pathlib import Path

from inhand.cli.answer import Answer
from inhand.cli.commands import ExportConfig
from inhand.control.spatial_catalogue import learned_entry
from inhand.errors import InputError
from inhand.pages import counted
from inhand.repeats import write_repeat

EXPORTS = Path("results/export")
"""Where exports are left, each in a folder named by the run and the form."""


def run_export(config: ExportConfig) -> Answer:
    """Write it, and say where it is."""
    if config.results is not None and config.form != "policy":
        raise InputError("--results is for the card of a policy: give it with --as policy")
    whom = {"hand": config.hand, "object": config.object}
    if config.form not in {"onnx", "policy"} and any(each is not None for each in whom.values()):
        raise InputError("--hand and --object say which policy rl is: leave them out with trials and demonstrations")
    if config.form == "onnx":
        from inhand.control.onnx_export import export

        model = export(config.run, config.out or Path("policy.onnx"), **whom, overwrite=config.overwrite)
        return Answer(sentences=(f"Model: {model}",), out=model)
    out = config.out or EXPORTS / f"{Path(config.run).resolve().stem}-{config.form}"
    if config.form == "policy":
        entry, policy = learned_entry(config.run, *whom.values())  # before all that draws is imported
        from inhand.learning.model_card import write_policy

        write_policy(entry.name, policy, Path(config.run), out, config.results, overwrite=config.overwrite)
        write_repeat(out, "export", config)
        return Answer(sentences=(f"Policy and card: {out}",), out=out)
    if not Path(config.run).exists():
        raise InputError(f"{config.run} is not there: give the folder of a run or of a dataset, or a trial's .npz file")
    from inhand.learning.travel import export_run

    done = export_run(Path(config.run), out, config.form, overwrite=config.overwrite)
    write_repeat(out, "export", config)
    what = "file" if config.form == "csv" else "episode"
    return Answer(sentences=(*done.notes, f"{counted(done.count, what)}: {out}"), out=out)
