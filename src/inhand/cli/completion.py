"""`inhand completion`: what makes a shell complete the words of `inhand`."""

from inhand.cli.answer import Answer
from inhand.cli.asked import told
from inhand.cli.commands import CompletionConfig


def run_completion(config: CompletionConfig) -> Answer:
    """Let tyro print it."""
    told(["--tyro-print-completion", config.shell])
    return Answer()
