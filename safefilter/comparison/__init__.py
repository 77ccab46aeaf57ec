"""Which solver, and at what setting: problem sets, an exact oracle, measures, and a report.

``safefilter compare`` is the command; `compare_backends` measures, and `Summary` sums up. Tables need rich, and plots
matplotlib (`pip install safefilter[compare]`): the files that use them are loaded on request.
"""

from __future__ import annotations

from safefilter.comparison.contender import Contender, Setting, contenders_of
from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem import Problem, ProblemSet, Truth
from safefilter.comparison.problem_file import read_problems, write_problems
from safefilter.comparison.recording import Recorder
from safefilter.comparison.runner import Comparison, Plan, compare_backends
from safefilter.comparison.shipped import SHIPPED, shipped_set
from safefilter.comparison.summary import Summary

__all__ = [
    "SHIPPED",
    "Comparison",
    "Contender",
    "Plan",
    "Problem",
    "ProblemSet",
    "Recorder",
    "Setting",
    "Summary",
    "Truth",
    "compare_backends",
    "contenders_of",
    "read_problems",
    "shipped_set",
    "truth_of",
    "write_problems",
]
