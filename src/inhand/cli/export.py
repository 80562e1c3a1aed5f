"""`inhand export`: a learned policy as an ONNX model."""

from inhand.cli.answer import Answer
from inhand.cli.commands import ExportConfig
from inhand.control.onnx_export import export


def run_export(config: ExportConfig) -> Answer:
    """Write a policy's model and say where it is."""
    model = export(config.policy, config.out, overwrite=config.overwrite)
    return Answer(sentences=(f"Model: {model}",), out=config.out)
