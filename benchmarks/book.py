"""Is every page of a built book whole? All pages in a browser, all links, search, a replay in both themes.

    python -m wfbook book --out results/book && python benchmarks/book.py results/book

Needs Debian's package chromium. Each fault is a line; exit code 1 if there is one.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))
from book_pages import (
    assert_a_replay_plays,
    backgrounds,
    browsed,
    dead_links,
    faults_of,
    found_by_search,
    pages_of,
)


def main() -> int:
    """Look at all pages, print what is wrong, and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path, help="of the book")
    folder = parser.parse_args().folder.resolve()
    names = pages_of(folder)
    chapter = next(name for name in names if name.startswith("chapters/"))
    faults = dead_links(folder)
    for scheme in ("light", "dark"):
        with browsed(folder, color_scheme=scheme) as watched:
            for name in names if scheme == "light" else ():
                faults += faults_of(watched, name)
            page = watched.open(chapter)
            assert_a_replay_plays(page)
            seen = backgrounds(page)
            if not seen["dark"] < 0.2 < 0.8 < seen["light"]:
                faults.append(f"{scheme}: light and dark are {seen}")
            if not found_by_search(watched, "friction"):
                faults.append(f"{scheme}: nothing is found")
            faults += [f"{scheme}: {text}" for text in (*watched.asked, *watched.complaints)]
    print(*faults, sep="\n", end="\n" if faults else "")
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    print(f"{len(names)} pages, {size / 1e6:.1f} MB, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
