"""The book as web pages: two quick chapters built as a reader builds it, and looked at in a browser."""

import re
import signal
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import ipywidgets
import nbformat
import psutil
import pytest
from book_pages import (
    assert_a_replay_plays,
    backgrounds,
    browsed,
    dead_links,
    faults_of,
    found_by_search,
    pages_of,
)
from chapters import Chapter as Stored
from ipywidgets.embed import dependency_state

import wfbook
from wfbook.__main__ import main
from wfbook.book import chapters as book_chapters
from wfbook.book import docstrings, execute, reference
from wfbook.book.build import BuildError, run_sphinx
from wfbook.book.chapters import Chapter, chapters
from wfbook.book.still import VIEW, drawn
from wfbook.results import WholeFolder
from wfbook.view.widgets.board import Board
from wfbook.view.widgets.panel import Panel

SWING, WHEELS = "chapters/02_swing_splines.html", "chapters/09_omnidirectional_wheels.html"
PACKAGE = Path(wfbook.__file__).parent


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    """The folder of a book of chapters 2 and 9, built by the command."""
    parent = tmp_path_factory.mktemp("book")
    command = [sys.executable, "-m", "wfbook", "book", "--only", "2", "9", "paper", "--out", "out/book"]
    done = subprocess.run(command, cwd=parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "2 chapters" in done.stdout and "index.html" in done.stdout
    assert [path.name for path in parent.iterdir()] == ["out"]
    assert [path.name for path in (parent / "out").iterdir()] == ["book"], "something else is left behind"
    return parent / "out" / "book"


def text_of(book, page):
    return (book / page).read_text(encoding="utf-8")


def test_every_page_is_whole_without_a_network(book):
    names = pages_of(book)
    assert {"index.html", "search.html", "licences.html", "paper/paper.html", SWING, WHEELS} <= set(names)
    with browsed(book) as watched:
        assert [fault for name in names for fault in faults_of(watched, name)] == []


def test_every_link_leads_somewhere(book):
    assert dead_links(book) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_replays_play_in_light_and_in_the_dark_and_words_are_found(book, scheme):
    with browsed(book, color_scheme=scheme) as watched:
        page = watched.open(WHEELS)
        assert_a_replay_plays(page)
        seen = backgrounds(page)
        assert seen["dark"] < 0.2 and seen["light"] > 0.8
        assert any(WHEELS in address for address in found_by_search(watched, "hysteresis"))
        assert (watched.asked, watched.complaints) == ([], [])


def test_faults_are_found(book, tmp_path):
    """A page that asks elsewhere, lacks a picture, has wrong mathematics and leads nowhere is told so."""
    page = text_of(book, "licences.html").replace(
        "<article",
        '<img src="https://example.org/a.png" alt=""><img src="none.png" alt=""><a href="#none">x</a>'
        '<span class="math">\\frac{</span><p style="width:900px">wide</p><article',
        1,
    )
    for name in ("_static", "search.html", "index.html", "replays", "chapters"):
        (tmp_path / name).symlink_to(book / name)
    (tmp_path / "licences.html").write_text(page)
    with browsed(tmp_path) as watched:
        found = "\n".join(faults_of(watched, "licences.html"))
    for words in ("asks https://example.org/a.png", "none.png", "can't be typeset", "wide on a telephone"):
        assert words in found
    assert any("#none: no such place" in line for line in dead_links(tmp_path))


def test_equations_have_the_papers_numbers_and_words_lead_to_them(book):
    swing, wheels = text_of(book, SWING), text_of(book, WHEELS)
    for number in range(2, 8):
        assert f'id="eq-a-{number}"' in swing
    for number in (12, 13, 14, 15, 22):
        assert f'id="eq-b-{number}"' in wheels
    assert "\\tag" not in re.sub(r"<pre>.*?</pre>", "", swing + wheels, flags=re.DOTALL)
    assert '<a class="reference internal" href="#eq-b-13">eq. 13</a>' in wheels
    assert 'eqs <a class="reference internal" href="#eq-a-6">6</a> and' in swing
    assert 'href="chapters/02_swing_splines.html#eq-a-2"' in text_of(book, "index.html")


def test_widgets_are_stills_with_their_values(book):
    for page in (SWING, WHEELS):
        stored = Stored(book_chapters.FOLDER / f"{Path(page).stem}.ipynb")
        text = text_of(book, page)
        assert VIEW not in text and "require.min.js" not in text
        stills = text.count('class="wfbook-still"')
        assert stills == 2, f"{stills} stills"
        assert stored.imported_from("wfbook.view.widgets")
    wheels = text_of(book, WHEELS)
    assert 'wfbook-name">turn (rad/s)</span>' in wheels and 'wfbook-value">0.80</span>' in wheels
    assert "<circle" in wheels and "steer first" in wheels


def test_solutions_are_folded_and_marks_are_gone(book):
    for page in (SWING, WHEELS):
        text = text_of(book, page)
        stored = Stored(book_chapters.FOLDER / f"{Path(page).stem}.ipynb")
        solutions = sum(bool(cell.metadata.get("nbgrader", {}).get("solution")) for cell in stored.cells)
        assert text.count("Show the solution") == solutions > 0
        for mark in ("BEGIN SOLUTION", "NBVAL", "Run All Cells"):
            assert mark not in text


def test_without_the_papers_numbers_their_page_says_how_to_get_them(book):
    assert "python -m wfbook paper" in text_of(book, "paper/paper.html")


def test_the_book_stays_small(book):
    size = sum(path.stat().st_size for path in book.rglob("*"))
    assert size < 15e6


def refused(capsys, folder, *argv):
    """Run with wrong input: one line on stderr, exit code 2, nothing written."""
    before = sorted(folder.rglob("*"))
    assert main(["book", *map(str, argv)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    assert sorted(folder.rglob("*")) == before
    return err


def test_wrong_input_is_one_line(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "draft.tex").write_text("years of work")
    (tmp_path / "file").write_text("")
    assert "--only: '77' is not a chapter of 0 to" in refused(capsys, tmp_path, "--only", "77")
    assert "'swing'" in refused(capsys, tmp_path, "--only", "2", "swing")
    assert "'thesis' holds something else" in refused(capsys, tmp_path, "--only", "2", "--out", "thesis")
    assert "can't be written" in refused(capsys, tmp_path, "--only", "2", "--out", "file/book")
    assert "can't be written" in refused(capsys, tmp_path, "--only", "2", "--out", "file")
    assert "'file' is no folder" in refused(capsys, tmp_path, "--only", "2", "--cache", "file")
    assert "--workers" in refused(capsys, tmp_path, "--workers", "0")


@pytest.fixture
def own_chapters(tmp_path, monkeypatch):
    """A function that makes a chapter of code cells, in a folder that takes the place of ``notebooks/``."""
    folder = tmp_path / "notebooks"
    folder.mkdir()
    monkeypatch.setattr(book_chapters, "FOLDER", folder)

    def make(name, *sources):
        cells = [nbformat.v4.new_markdown_cell("# A title")]
        cells += [nbformat.v4.new_code_cell(source) for source in sources]
        nbformat.write(nbformat.v4.new_notebook(cells=cells), folder / name)
        return folder / name

    return make


def test_a_chapter_that_fails_is_named_with_its_cell_and_the_old_book_stays(own_chapters, tmp_path, capsys):
    own_chapters("00_good.ipynb", "1 + 1")
    own_chapters("01_bad.ipynb", "x = 0", "1 / x")
    old = tmp_path / "book"
    old.mkdir()
    for name in ("objects.inv", "index.html"):
        (old / name).write_text("old")
    before = sorted(tmp_path.rglob("*"))
    assert main(["book", "--out", str(old)]) == 1
    err = capsys.readouterr().err.splitlines()
    assert err[-1] == "wfbook: 01_bad.ipynb, cell 2: ZeroDivisionError: division by zero"
    assert sorted(tmp_path.rglob("*")) == before and (old / "index.html").read_text() == "old"


def test_what_is_no_notebook_is_one_line(own_chapters, tmp_path, capsys):
    own_chapters("00_good.ipynb", "1 + 1").write_text("{}")
    assert main(["book", "--out", str(tmp_path / "book")]) == 2
    assert "00_good.ipynb" in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "book").exists()


def test_an_interrupt_leaves_nothing(own_chapters, tmp_path, capsys):
    marker = tmp_path / "begun"
    own_chapters("00_long.ipynb", f"open({str(marker)!r}, 'w').close()\nimport time\ntime.sleep(60)")

    def interrupt():
        while not marker.exists():
            pass
        signal.raise_signal(signal.SIGINT)

    threading.Thread(target=interrupt, daemon=True).start()
    assert main(["book", "--out", str(tmp_path / "book")]) == 130
    assert {path.name for path in tmp_path.iterdir()} == {"notebooks", "begun"}
    assert not [
        child for child in psutil.Process().children(recursive=True) if "ipykernel" in str(child.cmdline())
    ]


def test_a_cache_gives_back_what_has_not_changed(own_chapters, tmp_path, monkeypatch):
    path = own_chapters("00_good.ipynb", "1 + 1")
    kept = tmp_path / "kept"
    (first,) = execute.execute([path], 1, kept).values()
    assert first.cells[1].outputs[0].data["text/plain"] == "2"

    async def fail(*_):
        raise AssertionError("executed")

    monkeypatch.setattr(execute, "_one", fail)
    (again,) = execute.execute([path], 1, kept).values()
    assert again == nbformat.from_dict(first)
    own_chapters("00_good.ipynb", "1 + 2")
    with pytest.raises(AssertionError, match="executed"):
        execute.execute([path], 1, kept)


def test_chapters_say_what_they_are():
    found = chapters()
    assert [chapter.number for chapter in found] == list(range(len(found)))
    for chapter in found:
        assert chapter.title and chapter.promise.endswith((".", "!", "?")) and chapter.needs["Equations"]
    assert Chapter(found[2].path).page == "chapters/02_swing_splines"


def still_of(widget):
    """Return the still of a widget as it is now."""
    return drawn(dependency_state([widget], drop_defaults=False), widget.model_id)


def test_a_still_shows_what_is_chosen():
    slider = ipywidgets.FloatLogSlider(10.0, min=0, max=4, description="charge <", readout_format=".2g")
    assert "left:25.0%" in still_of(slider) and "charge &lt;" in still_of(slider)
    choice = ipywidgets.Dropdown(options=[("near", 1), ("far", 2)], value=2)
    assert "far" in still_of(choice) and "near" not in still_of(choice)
    steps = ipywidgets.SelectionSlider(options=("a", "b", "c"), value="b")
    assert "left:50.0%" in still_of(steps) and ">b<" in still_of(steps)
    for value in (True, False):
        assert ("checked" in still_of(ipywidgets.Checkbox(value, description="on"))) == value
        assert ("mod-active" in still_of(ipywidgets.ToggleButton(value))) == value
    rows = still_of(ipywidgets.ToggleButtons(options=("foot", "wheel"), value="wheel"))
    assert 'wfbook-choice">foot' in rows and 'mod-active">wheel' in rows


def test_a_still_follows_handles_and_panels():
    board = Board({"a": (0.0, 0.0), "b": (1.0, 1.0)}, carriers={"b": "a"})
    assert still_of(board).count("<circle") == 2 and "<line" in still_of(board)
    before = still_of(board)
    board.move("a", 0.5, 0.0)
    assert still_of(board) != before
    panel = Panel.__new__(Panel)
    ipywidgets.VBox.__init__(panel, [ipywidgets.HTML("<b>nine</b>"), ipywidgets.Label("a & b")])
    assert "<b>nine</b>" in still_of(panel) and "a &amp; b" in still_of(panel)


def test_every_kind_of_widget_that_the_book_uses_has_a_still():
    text = "".join(path.read_text() for path in (PACKAGE / "view" / "widgets").glob("*.py"))
    kinds = set(re.findall(r"ipywidgets\.([A-Z]\w+)\(", text)) - {"Layout"}
    assert len(kinds) > 8
    for kind in kinds:
        options = (
            {"options": ("a", "b")} if kind.startswith(("Dropdown", "Selection", "ToggleButtons")) else {}
        )
        assert "<div" in still_of(getattr(ipywidgets, kind)(**options)) or kind == "HTML"


def test_a_widget_without_a_still_is_named():
    with pytest.raises(ValueError, match="no still of a widget of kind 'PlayModel'"):
        still_of(ipywidgets.VBox([ipywidgets.Play()]))
    with pytest.raises(ValueError, match="no state of the widget 'gone'"):
        drawn({}, "gone")


def paged(tmp_path, **texts):
    """Run Sphinx on Markdown pages alone; return the folder of what it made."""
    sources, out = tmp_path / "sources", tmp_path / "out"
    (sources / "chapters").mkdir(parents=True)
    names = sorted(texts)
    toctree = "# T\n\n```{toctree}\n" + "\n".join(f"chapters/{name}" for name in names) + "\n```\n"
    (sources / "index.md").write_text(toctree)
    for name, text in texts.items():
        (sources / "chapters" / f"{name}.md").write_text(f"# {name}\n\n{text}\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what the theme and MyST call will change in Sphinx 11
        run_sphinx(sources, out, tmp_path / "doctrees", {"html_static_path": []}, 1)
    return {name: (out / "chapters" / f"{name}.html").read_text() for name in names}


def links(text):
    """The links that words have become: address and words."""
    text = text.partition("<article")[2].partition("</article>")[0]
    return re.findall(
        r'<a class="reference internal" href="([^"]*#eq[^"]*|\d\d_\w+\.html)">([^<]*)</a>', text
    )


def test_words_become_links(tmp_path):
    pages = paged(
        tmp_path,
        **{
            "00_over": "$$a \\tag{A 1}$$\n\nSee eq. 1, eq. 2 and chapters 1 and 9; not eq. 5 nor chapter 7.",
            "01_body": "$$a \\tag{A 1}$$\n\n$$b \\tag{A 2}$$\n\nEqs 1 to 2. `eq. 1` is code. (B 1), not B 1.",
            "09_wheels": "$$c \\tag{B 1}$$\n\n**Eq. 1** is B's. Paper A, eq. 2 is not; nor eq. 1.\n\nEq. 1",
        },
    )
    assert links(pages["00_over"])[:3] == [
        ("#eq-a-1", "eq. 1"),
        ("01_body.html#eq-a-2", "eq. 2"),
        ("01_body.html", "1"),
    ]
    tagged = ("09_wheels.html#eq-b-1", "B 1")
    assert links(pages["01_body"]) == [("#eq-a-1", "1"), ("#eq-a-2", "2"), tagged]
    assert links(pages["09_wheels"]) == [
        ("#eq-b-1", "Eq. 1"),
        ("01_body.html#eq-a-2", "Paper A, eq. 2"),
        ("01_body.html#eq-a-1", "eq. 1"),
        ("#eq-b-1", "Eq. 1"),
    ]


def test_a_fault_in_the_sources_is_told(tmp_path):
    with pytest.raises(BuildError, match=r"chapters/01_x\.md:3: WARNING"):
        paged(tmp_path, **{"01_x": "[nowhere](nowhere.md)"})


def test_no_page_tells_where_it_was_built(book):
    for name in pages_of(book):
        assert str(PACKAGE.parent) not in text_of(book, name), name


def test_signatures_are_python_without_the_folder_of_the_project():
    path = f"PosixPath('{PACKAGE.parent}/assets/x.xml')"
    given = f"(rows: list = <factory>, f=<function X.<lambda> at 0x7f>, model: Path = {path}, n: int = 3)"
    signature, _ = docstrings._readable(None, "class", "x", None, {}, given, None)
    assert signature == "(rows: list = ..., f=..., model: Path = 'assets/x.xml', n: int = 3)"


def test_the_reference_has_every_module_once():
    listed = [name for _, names in reference.groups() for name in names]
    assert len(listed) == len(set(listed))
    there = {
        ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
        for path in PACKAGE.rglob("*.py")
    }
    assert there - set(listed) == {"wfbook", "wfbook.__main__", "wfbook.book.conf"}


def test_a_whole_folder_replaces_what_was_there_and_nothing_else(tmp_path):
    target = tmp_path / "new" / "book"
    with WholeFolder(target, "mark") as folder:
        (folder.path / "mark").write_text("one")
        (folder.path / "old").write_text("")
        (folder.scratch / "x").write_text("")
        assert not target.exists()
        folder.publish()
    assert {path.name for path in target.iterdir()} == {"mark", "old"}
    with pytest.raises(KeyError), WholeFolder(target, "mark") as folder:
        (folder.path / "mark").write_text("two")
        raise KeyError
    assert (target / "mark").read_text() == "one"
    with WholeFolder(target, "mark") as folder:
        (folder.path / "mark").write_text("three")
        folder.publish()
    assert {path.name for path in target.iterdir()} == {"mark"}
    assert (target / "mark").read_text() == "three"
    assert [path.name for path in target.parent.iterdir()] == ["book"]
    with pytest.raises(ValueError, match="holds something else"), WholeFolder(tmp_path, "mark"):
        pass
    with pytest.raises(KeyError), WholeFolder(tmp_path / "a" / "b", "mark"):
        raise KeyError
    assert not (tmp_path / "a").exists()
