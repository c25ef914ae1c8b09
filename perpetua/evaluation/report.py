"""Scores of one or several sequences, for a terminal and as JSON."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.markup import escape
from rich.table import Table

from perpetua.audit.verify import find_sequences
from perpetua.errors import InputError
from perpetua.evaluation.baselines import BASELINES
from perpetua.evaluation.metrics import THRESHOLDS_PX, Scores
from perpetua.evaluation.predictions import Predictions, SequenceSize, read_predictions, write_predictions
from perpetua.evaluation.protocol import REGIMES, Evaluation, evaluate_sequence
from perpetua.formats.reader import Sequence, read_sequence

NOTHING = Scores(0.0, 0.0, 0.0, (0.0,) * len(THRESHOLDS_PX), (0.0,) * len(THRESHOLDS_PX))


@dataclass(frozen=True)
class EvaluationReport:
    """What was found for each sequence; None where there is no prediction of it, which counts as a failure."""

    found: dict[str, Evaluation | None]

    def mean(self) -> dict[str, Scores]:
        """Mean over sequences by regime; a sequence without prediction scores 0 in each regime that others have."""
        means = {}
        for regime in REGIMES:
            several = [
                NOTHING if evaluation is None else evaluation.scores[regime]
                for evaluation in self.found.values()
                if evaluation is None or regime in evaluation.scores
            ]
            if any(scores is not NOTHING for scores in several):
                means[regime] = _mean(several)
        return means

    def to_json(self) -> dict[str, Any]:
        """The report as JSON values."""
        return {
            "thresholds_px": list(THRESHOLDS_PX),
            "mean": {regime: asdict(scores) for regime, scores in self.mean().items()},
            "sequences": {
                name: None if evaluation is None else asdict(evaluation) for name, evaluation in self.found.items()
            },
        }

    def table(self) -> Table:
        """AJ, APD and OA by sequence and regime."""
        table = Table("sequence", "regime", "AJ", "APD", "OA", title_justify="left")
        for name, evaluation in self.found.items():
            if evaluation is None:
                table.add_row(escape(name), "not predicted: counts as a failure", "0.0000", "0.0000", "0.0000")
            else:
                _add_rows(table, name, evaluation.scores)
        if len(self.found) > 1:
            table.add_section()
            _add_rows(table, "mean", self.mean())
        return table


def _add_rows(table: Table, name: str, scores: dict[str, Scores]) -> None:
    for regime, found in scores.items():
        figures = (found.average_jaccard, found.average_position_accuracy, found.occlusion_accuracy)
        table.add_row(escape(name), regime, *(f"{figure:.4f}" for figure in figures))
        name = ""


def _mean(several: list[Scores]) -> Scores:
    return Scores(
        average_jaccard=float(np.mean([scores.average_jaccard for scores in several])),
        average_position_accuracy=float(np.mean([scores.average_position_accuracy for scores in several])),
        occlusion_accuracy=float(np.mean([scores.occlusion_accuracy for scores in several])),
        jaccard=tuple(np.mean([scores.jaccard for scores in several], axis=0).tolist()),
        position_accuracy=tuple(np.mean([scores.position_accuracy for scores in several], axis=0).tolist()),
    )


def evaluate_files(predicted: Path, folder: Path, score_queries: bool = False) -> EvaluationReport:
    """Scores a file of predictions for a sequence, or a folder of files ``<sequence>.npz`` for a folder of sequences.

    Raises:
        InputError: a file or a sequence cannot be read, or a folder of sequences comes with a single file.
    """
    folders = find_sequences(folder)
    if not predicted.is_dir() and len(folders) > 1:
        raise InputError(
            f"'{folder}' holds {len(folders)} sequences: give a folder with one <sequence>.npz for each, or the folder "
            f"of a single sequence, not '{predicted}'"
        )

    def source(sequence: Sequence) -> Predictions | None:
        path = predicted / f"{sequence.folder.absolute().name}.npz" if predicted.is_dir() else predicted
        if predicted.is_dir() and not path.exists():
            return None
        return read_predictions(path, SequenceSize(len(sequence.views), *sequence.tracks_m.shape[:2]))

    report = _evaluate(folders, source, score_queries)
    if all(evaluation is None for evaluation in report.found.values()):
        wanted = f"{folders[0].absolute().name}.npz"
        raise InputError(f"'{predicted}' has no prediction of any sequence in '{folder}': for example '{wanted}'")
    return report


def evaluate_baseline(
    name: str, folder: Path, score_queries: bool = False, save: Path | None = None
) -> EvaluationReport:
    """Runs a built-in tracker on one or several sequences and scores it.

    Args:
        name: one of ``BASELINES``.
        folder: a sequence, or a folder that holds some.
        score_queries: as for ``evaluate_sequence``.
        save: file to write the predictions of a single sequence to.

    Raises:
        InputError: a sequence cannot be read or has no depth, or there are several for one file.
    """
    folders = find_sequences(folder)
    if save is not None and len(folders) > 1:
        raise InputError(f"'{folder}' holds {len(folders)} sequences; predictions of one can be saved: choose one")

    def source(sequence: Sequence) -> Predictions:
        predictions = BASELINES[name](sequence)
        if save is not None:
            write_predictions(save, predictions)
        return predictions

    return _evaluate(folders, source, score_queries)


def _evaluate(
    folders: list[Path], source: Callable[[Sequence], Predictions | None], score_queries: bool
) -> EvaluationReport:
    found: dict[str, Evaluation | None] = {}
    for folder in folders:
        sequence = read_sequence(folder)
        predictions = source(sequence)
        name = folder.absolute().name
        found[name if name not in found else str(folder)] = (
            None if predictions is None else evaluate_sequence(sequence, predictions, score_queries)
        )
    return EvaluationReport(found)
