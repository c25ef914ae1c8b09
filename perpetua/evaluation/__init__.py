"""Scores of predicted tracks against finished sequences, and simple trackers to compare with."""

from perpetua.evaluation.baselines import BASELINES
from perpetua.evaluation.metrics import Scores
from perpetua.evaluation.predictions import (
    Geometry,
    Predictions,
    SequenceSize,
    read_predictions,
    write_predictions,
)
from perpetua.evaluation.protocol import Evaluation, evaluate_sequence
from perpetua.evaluation.report import EvaluationReport, evaluate_baseline, evaluate_files

__all__ = [
    "BASELINES",
    "Evaluation",
    "EvaluationReport",
    "Geometry",
    "Predictions",
    "Scores",
    "SequenceSize",
    "evaluate_baseline",
    "evaluate_files",
    "evaluate_sequence",
    "read_predictions",
    "write_predictions",
]
