"""`inhand export`: a learned policy as an ONNX model."""

from pathlib import Path

from inhand.cli.terminal import say
from inhand.control.onnx_export import export


def run_export(policy: str, out: Path, *, overwrite: bool) -> None:
    """Write a policy's model and say where it is."""
    say(f"Model: {export(policy, out, overwrite=overwrite)}")
