"""What holds for every run of pytest: chapters are timed, and nothing is left running."""

from chapter_times import OPTION, ChapterTimes
from leftovers import Leftovers


def pytest_addoption(parser):
    """Let the chapters' budgets be written again."""
    parser.addoption(
        OPTION,
        action="store_true",
        help="write the times of the chapters that were run to tests/chapter_times.json, as their budgets",
    )


def pytest_configure(config):
    """Watch the chapters' cells, and the processes."""
    config.pluginmanager.register(ChapterTimes(config), "chapter-times")
    if not hasattr(config, "workerinput"):  # pytest-xdist's workers inherit the mark
        config.pluginmanager.register(Leftovers(), "leftovers")
