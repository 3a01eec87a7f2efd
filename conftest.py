"""Times the chapters in every run of pytest; see tests/chapter_times.py."""

from chapter_times import OPTION, ChapterTimes


def pytest_addoption(parser):
    """Let the budgets be written again."""
    parser.addoption(
        OPTION,
        action="store_true",
        help="write the times of the chapters that were run to tests/chapter_times.json, as their budgets",
    )


def pytest_configure(config):
    """Watch the chapters' cells."""
    config.pluginmanager.register(ChapterTimes(config), "chapter-times")
