"""`inhand completion`: what makes a shell complete the words of `inhand`."""

from contextlib import redirect_stdout, suppress
from io import StringIO

from inhand.cli.answer import Answer
from inhand.cli.asked import told
from inhand.cli.commands import CompletionConfig


def run_completion(config: CompletionConfig) -> Answer:
    """Return what tyro prints."""
    script = StringIO()
    with redirect_stdout(script), suppress(SystemExit):
        told(["--tyro-print-completion", config.shell])
    return Answer(sentences=(script.getvalue().rstrip("\n"),))
