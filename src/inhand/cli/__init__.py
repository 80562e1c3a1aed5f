"""The command line: `inhand` and a command.

`commands.py` lists the commands; each has a module here whose function `run_` and the command's name does its work and
returns what is printed at the end. `inhand help` and `inhand help trace` are other words for `--help`; `inhand
--version` tells the version. Each command's configuration is light; what it runs is imported only when it is run, so
that `--help` stays fast.
"""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from inhand.cli.asked import Asked


def main() -> None:
    """Run the console command `inhand`; bad input ends with its text and exit code 2, Ctrl-C or SIGTERM with 130."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)  # how schedulers stop: nothing half written stays
    try:
        if _done(sys.argv[1:]):
            sys.exit(1)
    except BrokenPipeError:  # who read what is printed, such as `head`, has enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except KeyboardInterrupt:
        sys.stderr.write("inhand: stopped; nothing was overwritten\n")
        sys.exit(130)


def _done(words: list[str]) -> bool:
    """Do what words say and return whether it found a fault.

    All is imported here, so that Ctrl-C ends a command in a sentence while it is imported too.
    """
    if words[:1] in (["--version"], ["-V"]):
        from inhand import __version__

        sys.stdout.write(f"inhand {__version__}\n")
        return False
    if words[:1] == ["help"]:
        words = [*words[1:], "--help"]
    from inhand.errors import InputError, shortened

    try:
        from inhand.cli.asked import asked

        return run(asked(words))
    except InputError as error:
        told = str(error)
    except OSError as error:
        if error.errno not in {errno.ENAMETOOLONG, errno.ELOOP}:
            raise
        told = f"{error.filename}: {error.strerror}; give another path"
    sys.stderr.write(f"inhand: {shortened(told)}\n")
    sys.exit(2)


def run(wanted: Asked) -> bool:
    """Do what is asked for, print what comes out, and return whether it found a fault."""
    from inhand.cli.answer import tell, working
    from inhand.cli.work import check_names, worker

    with working(wanted.printing):
        check_names(wanted.config)
        answer = worker(wanted.command)(wanted.config)
    tell(wanted.command, answer, wanted.printing)
    return answer.failed
