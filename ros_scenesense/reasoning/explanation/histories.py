"""Explanations of what is believed of a domain with a history: any domain, at any step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import clingo
from clingo import ast

from ros_scenesense.errors import ParameterError, ReasoningError
from ros_scenesense.knowledge.action_language import parse_literal
from ros_scenesense.knowledge.building import Domain
from ros_scenesense.knowledge.translation import Options, translate
from ros_scenesense.reasoning.explanation.history_vocabulary import HistoryVocabulary
from ros_scenesense.reasoning.explanation.proof import Proofs
from ros_scenesense.reasoning.explanation.reason import Reason
from ros_scenesense.reasoning.explanation.refutation import Refutations
from ros_scenesense.reasoning.explanation.rules import Rule
from ros_scenesense.reasoning.explanation.support import instances
from ros_scenesense.reasoning.explanation.telling import Teller
from ros_scenesense.reasoning.program import Messages, parse
from ros_scenesense.reasoning.solving import QUIET


@dataclass(frozen=True)
class HistoryExplanation:
    """The answer to "why?" or "why not?".

    Attributes:
        literal: The literal asked about.
        step: The step.
        holds: Whether it is believed.
        reason: Why it is, or why it is not.
        restored: Whether CR rules had to be applied.
        others: Whether there are other answer sets, about which nothing is said.
    """

    literal: str
    step: int
    holds: bool
    reason: Reason
    restored: bool
    others: bool


class HistoryExplanationEngine:
    """Explains domains with histories; remembers nothing between two calls."""

    def explain(
        self, domain: Domain, options: Options, text: str, step: int | None
    ) -> HistoryExplanation:
        """Solves a domain with its history and explains a literal of the first answer set.

        Args:
            domain: The domain.
            options: How it is translated.
            text: The literal.
            step: The step; None for the last one.

        Raises:
            LanguageError: If the literal is wrong.
            ParameterError: If there is no such step.
            ReasoningError: If there is no answer set, so that there is nothing to explain.
        """
        literal = parse_literal(text, domain.description)
        last = domain.history.last_step if options.steps is None else options.steps
        step = last if step is None else step
        if not 0 <= step <= last:
            raise ParameterError(f"step {step}: the steps are 0 to {last}")
        program = translate(domain.description, domain.history, options)
        nodes = parse(program, "translation")
        solved = _solved(program)
        vocabulary = HistoryVocabulary(domain.description, program, nodes)
        found = (Rule.of(index, node) for index, node in enumerate(nodes))
        rules = [rule for rule in found if rule is not None]
        definitions = _definitions(nodes, solved.restored)
        proofs = Proofs((), instances(rules, definitions, solved.answer))
        teller = Teller(vocabulary, proofs)
        symbol = vocabulary.symbol(literal, step)
        proof = proofs.of(symbol)
        if proof is not None:
            reason = teller.proof(proof)
        else:
            # The opposite first, since what is told once is only mentioned after that.
            opposite = proofs.of(vocabulary.symbol(literal.complement, step))
            told = () if opposite is None else (teller.proof(opposite),)
            refutations = Refutations(rules, definitions, solved.answer)
            reason = teller.refutation(refutations.of(symbol))
            reason = replace(reason, reasons=(*told, *reason.reasons))
        return HistoryExplanation(
            literal=str(literal),
            step=step,
            holds=proof is not None,
            reason=reason,
            restored=solved.restored,
            others=solved.others,
        )


@dataclass(frozen=True)
class _Solved:
    answer: frozenset[clingo.Symbol]
    restored: bool
    others: bool


def _solved(program: str) -> _Solved:
    """The first answer set, with CR rules only where there is none without."""
    for restore in (0, 1):
        models: list[frozenset[clingo.Symbol]] = []

        def take(model: clingo.Model, found: list[frozenset[clingo.Symbol]] = models) -> None:
            if model.optimality_proven or not model.cost:
                found.append(frozenset(model.symbols(atoms=True)))

        with Messages("translation") as messages:
            arguments = [*QUIET, "2", "--opt-mode=optN", "-c", f"restore={restore}"]
            control = clingo.Control(arguments, logger=messages.take)
            control.add("base", [], program)
            control.ground()
            control.solve(on_model=take)
        if models:
            return _Solved(models[0], bool(restore), len(set(models)) > 1)
    raise ReasoningError(
        "there is no answer set, not even with CR rules: nothing is believed, so there is nothing "
        "to explain"
    )


def _definitions(nodes: Sequence[ast.AST], restored: bool) -> list[ast.AST]:
    kept = [
        node
        for node in nodes
        if node.ast_type == ast.ASTType.Definition and str(node.name) != "restore"
    ]
    return [*kept, *parse(f"#const restore = {int(restored)}.", "translation")]
