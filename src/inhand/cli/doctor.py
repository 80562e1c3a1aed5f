"""`inhand doctor`: what this installation has and lacks."""

from dataclasses import asdict

from inhand.cli.answer import Answer, Listing
from inhand.cli.commands import DoctorConfig
from inhand.doctor import look


def run_doctor(_: DoctorConfig) -> Answer:
    """Return what was looked at; without what the package itself requires, the command fails."""
    found = look()
    rows = [(each.part, each.name, each.state, each.told) for each in found]
    broken = [each.name for each in found if each.part == "package" and each.state == "missing"]
    lacking = [each.name for each in found if each.part == "extra" and each.state == "missing"]
    sentences = [f"Broken without {', '.join(broken)}" if broken else "All that the package itself needs is here"]
    if lacking:
        sentences.append(f"Extras that are not whole: {', '.join(lacking)}")
    table = Listing("This installation", ("Part", "Name", "State", "Found"), rows, numbers=4)
    return Answer((table,), tuple(sentences), lambda: [asdict(each) for each in found], failed=bool(broken))
