"""The site's table of contents, as the lists of index.md have it: a code host shows the lists, the site a side bar."""

import re

SECTION = re.compile(r"^## (.+)$", re.MULTILINE)
PAGE = re.compile(r"^[*-] \[[^\]]+\]\(([\w-]+)\.md\)", re.MULTILINE)


def sections(text: str) -> dict[str, list[str]]:
    """Return the pages that the list under each heading of a text names, without their ending."""
    _, *parts = SECTION.split(text)
    found = {title: PAGE.findall(body) for title, body in zip(parts[::2], parts[1::2], strict=True)}
    return {title: pages for title, pages in found.items() if pages}


def side_bar(text: str) -> str:
    """Return the directives that put the pages of a text's lists into the side bar."""
    blocks = (
        "\n".join(["```{toctree}", ":hidden:", f":caption: {title}", "", *pages, "```"])
        for title, pages in sections(text).items()
    )
    return "\n\n".join(blocks)
