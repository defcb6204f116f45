"""The list of mutants: its files and tests exist, and only words are accepted without a reason."""

import subprocess
import sys
import tomllib

import pytest

from tests.mutant_changes import Change, changes_of, only_wording
from tests.paths import ROOT

TABLE = tomllib.loads((ROOT / "tests" / "mutants.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('raise InputError("no room", where=x)', "raise InputError(None, where=x)", True),
        ('raise InputError("no room")', 'raise ValueError("no room")', False),
        ('raise ValueError("no room")', "pass", False),
        ("if x > 1:", "if x >= 1:", False),
        ('return Fault(A, expected="x")', "return Fault(A, expected=None)", True),
        ('return Fault(A, expected="x")', "return Fault(B)", False),
        (
            'return f(A, "the CRC of its content")',
            'return f(A, "XXthe CRC of its contentXX")',
            True,
        ),
        ('return f["name"]', 'return f["XXnameXX"]', False),
        ("for a, b in zip(c, d, strict=True):", "for a, b in zip(c, d):", True),
        ("for a, b in zip(c, d, strict=True):", "for a, b in zip(c, None, strict=True):", False),
        ("elif a or b:", "elif a and b:", False),
        ("else:", "else:\nx", False),
        ("return f(x, strict=True)", "return f(x)", False),
    ],
)
def test_words_and_internal_checks_are_told_from_what_the_program_does(before, after, words):
    assert only_wording(Change("module.f", before, after)) == words


def test_a_change_is_named_by_function_and_lines(tmp_path):
    file = tmp_path / "m.py"
    file.write_text(
        "class C:\n"
        "    def xǁCǁf__mutmut_orig(self, x):\n        y = x + 1\n        return y\n"
        "    def xǁCǁf__mutmut_1(self, x):\n        y = x - 1\n        return y\n"
        "def x_g__mutmut_orig(x=1):\n    return x\n"
        "def x_g__mutmut_1(x=2):\n    return x\n",
        encoding="utf-8",
    )
    method, function = "slipbench.a.m.xǁCǁf__mutmut_1", "slipbench.a.m.x_g__mutmut_1"
    assert changes_of(file, [method, function]) == {
        method: Change("a.m.C.f", "y = x + 1", "y = x - 1"),
        function: Change("a.m.g", "def (x=1)", "def (x=2)"),
    }


def test_every_file_and_test_of_the_list_exists():
    for group in TABLE["group"].values():
        for file in group["files"]:
            assert (ROOT / "src" / "slipbench" / file).is_file(), file
        for test in [*group["tests"], *group.get("slow", [])]:
            path, _, name = test.partition("::")
            assert (ROOT / path).exists(), test
            if name:
                assert f"def {name}(" in (ROOT / path).read_text(encoding="utf-8"), test


def test_every_accepted_survivor_has_a_reason_and_stands_once():
    listed = [
        (entry["function"], *change) for entry in TABLE["accepted"] for change in entry["changes"]
    ]
    assert len(set(listed)) == len(listed)
    assert all(entry["reason"].strip() for entry in TABLE["accepted"])


def test_a_file_of_tests_that_cannot_be_imported_ends_the_run(tmp_path):
    """Else its laws would be missing, and every mutant that only they kill would survive."""
    (tmp_path / "test_broken.py").write_text("import nothing_of_this_name\n", encoding="utf-8")
    (tmp_path / "test_whole.py").write_text("def test_it():\n    pass\n", encoding="utf-8")
    names = tmp_path / "mutants.json"
    names.write_text("[]", encoding="utf-8")
    options = [
        "-p",
        "no:xdist",
        "-p",
        "no:cacheprovider",
        "-p",
        "tests.mutant_plugin",
        "-o",
        "addopts=",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, "--mutants", str(names), str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0
    assert "cannot be imported" in done.stdout
    assert not names.with_suffix(".codes").exists()
