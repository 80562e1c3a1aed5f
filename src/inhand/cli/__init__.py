"""The command line: `inhand` and a command.

`commands.py` lists the commands; each has a module here whose function `run_` and the command's name does its work and
returns what is printed at the end. `inhand help` and `inhand help trace` are other words for `--help`; `inhand
--version` tells the version. Each command's configuration is light; what it runs is imported only when it is run, so
that `--help` stays fast.
"""

import os
import sys

from inhand import __version__
from inhand.cli.asked import Asked, asked
from inhand.errors import InputError


def main() -> None:
    """Run the console command `inhand`; bad input ends with its text and exit code 2, Ctrl-C with 130."""
    words = sys.argv[1:]
    if words[:1] in (["--version"], ["-V"]):
        sys.stdout.write(f"inhand {__version__}\n")
        return
    if words[:1] == ["help"]:
        words = [*words[1:], "--help"]
    try:
        if run(asked(words)):
            sys.exit(1)
    except InputError as error:
        sys.stderr.write(f"inhand: {error}\n")
        sys.exit(2)
    except BrokenPipeError:  # who read what is printed, such as `head`, has enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except KeyboardInterrupt:
        sys.stderr.write("inhand: stopped; nothing was overwritten\n")
        sys.exit(130)


def run(wanted: Asked) -> bool:
    """Do what is asked for, print what comes out, and return whether it found a fault."""
    from inhand.cli.answer import tell, working
    from inhand.cli.work import worker

    with working(wanted.printing):
        answer = worker(wanted.command)(wanted.config)
    tell(wanted.command, answer, wanted.printing)
    return answer.failed
