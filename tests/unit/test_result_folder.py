"""A result is there whole or not at all, and nothing that another put there is lost."""

from __future__ import annotations

import pytest
import sphereflow
from sphereflow import result_folder
from sphereflow.result_folder import REPORT, ResultFolder


def write(folder: ResultFolder, text: str) -> None:
    (folder.path / REPORT).write_text(text)


def finish(folder: ResultFolder) -> None:
    folder.__exit__(None, None, None)


def test_result_of_another_run_that_finished_first_is_kept(tmp_path):
    out = tmp_path / "out"
    late = ResultFolder(out).__enter__()
    write(late, "late")
    with ResultFolder(out) as early:
        write(early, "early")
    with pytest.raises(sphereflow.DataError, match="finished result is in") as raised:
        finish(late)
    assert (out / REPORT).read_text() == "early"
    assert (late.path / REPORT).read_text() == "late"
    assert str(late.path) in str(raised.value)


def test_folder_that_a_user_filled_meanwhile_is_kept(tmp_path):
    out = tmp_path / "out"
    folder = ResultFolder(out, overwrite=True).__enter__()
    write(folder, "new")
    out.mkdir()
    (out / "notes.txt").write_text("mine")
    with pytest.raises(sphereflow.DataError, match=REPORT):
        finish(folder)
    assert (out / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("can_exchange", [True, False])
def test_overwrite_replaces_a_result_and_leaves_nothing_else(tmp_path, monkeypatch, can_exchange):
    if not can_exchange:
        monkeypatch.setattr(result_folder, "_exchange", lambda first, second: False)
    out = tmp_path / "out"
    for text in ("old", "new"):
        with ResultFolder(out, overwrite=True) as folder:
            write(folder, text)
    assert (out / REPORT).read_text() == "new"
    assert list(tmp_path.iterdir()) == [out]


def test_partial_folder_of_a_killed_run_does_not_block_the_next(tmp_path):
    (tmp_path / ".out.partial-killed").mkdir()
    with ResultFolder(tmp_path / "out") as folder:
        write(folder, "whole")
    assert (tmp_path / "out" / REPORT).is_file()
