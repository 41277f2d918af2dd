"""Programs in test/sparc: each has its answer sets, or what is wrong with it, on its last lines.

`%= a p(1)` is an answer set, `%= none` says that there is none, `%! 7:1: words` is a problem. All
were worked out by hand.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from ros_scenesense.errors import LanguageError
from ros_scenesense.knowledge.sparc.language import load
from ros_scenesense.knowledge.sparc.translation import translated
from ros_scenesense.reasoning.answer_sets import AnswerSetEngine, Question

PROGRAMS = sorted((Path(__file__).parent / "sparc").glob("*.sp"))


def expected(path: Path, mark: str) -> list[str]:
    lines = path.read_text().splitlines()
    return [line[2:].strip() for line in lines if line.startswith(mark)]


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_a_program_has_the_answer_sets_or_the_problems_that_it_says(path: Path) -> None:
    problems = expected(path, "%!")
    if problems:
        with pytest.raises(LanguageError) as caught:
            load(path)
        found = str(caught.value).splitlines()
        assert len(found) == len(problems), found
        for line, problem in zip(found, problems, strict=True):
            assert line.startswith(f"{path}:{problem.replace('FILE', str(path))}")
        return
    program = load(path)
    translation = translated(program)
    answers = AnswerSetEngine().solve(
        Question(
            text=translation.text,
            applied=translation.applied,
            models=0,
            optimize=program.optimizes,
        )
    )
    assert answers.complete
    found = [sorted((*literals, *translation.shown)) for literals in answers.sets]
    sets = [sorted(line.split()) for line in expected(path, "%=")]
    assert sorted(found) == sorted([] if sets == [["none"]] else sets)
    # Nothing that clingo would have to warn of, and no answer set twice.
    assert answers.messages == ()
    assert len(answers.sets) == len(set(answers.sets))


def test_there_are_enough_of_them() -> None:
    assert len(PROGRAMS) >= 40
