"""TrainingRun: a training in a folder: checkpoints, the learning curve, and the weights in the end.

Letters: none. SI units.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from torch.utils.tensorboard import SummaryWriter

from envs.scenarios import load_scenario
from policies.atomic_file import TEMPORARY, write_atomically
from policies.card import Card
from policies.checkpoint import write_weights
from policies.evaluation import evaluate_policy
from policies.learned_policy import LearnedPolicy
from policies.policy_weights import Weights
from policies.settings_file import differences, plain_settings
from policies.torch_state import as_arrays
from policies.trainer import Progress, Trainer
from policies.training_checkpoint import TrainingCheckpoints
from policies.training_settings import TrainingSettings
from safefilter.errors import InvalidInput

CHECKED = ("passing", "overtaking", "crossroad", "n_c_o_intersection")
"""Scenarios that a policy is driven through while it is trained: the paper's four."""
CHECK_EPISODES = 40
CHECK_SEED = 10_000
"""Far from the seeds of tables."""
CHECKPOINTS, EVENTS, CURVE, WEIGHTS = "checkpoints", "events", "curve.json", "weights.safetensors"
"""What lies in the folder of a training."""
MADE = (
    f"{CHECKPOINTS}/training-*.safetensors",
    f"{CHECKPOINTS}/.training-*{TEMPORARY}",
    f"{EVENTS}/events.out.tfevents.*",
    CURVE,
    WEIGHTS,
    str(Path(WEIGHTS).with_suffix(".json")),
)
"""Files that trainings make."""
LIMITS = (
    "Differential drives of the size and speed of a Turtlebot3, at 5 decisions a second.",
    "Alone it collides: whoever executes it needs the filter, which is what rules collisions out.",
    "Other robots are taken for cooperative, with the same policy.",
)


@dataclass(frozen=True, slots=True)
class RunOptions:
    """How a training is looked after; none of it changes what is learnt.

    Attributes:
        name: What the policy is called on its card.
        command: What to type for the same training.
        keep_every: Steps between checkpoints; 0: only one, in the end.
        check_every: Steps between checks in the paper's scenarios; 0: none.
    """

    name: str
    command: str
    keep_every: int = 500_000
    check_every: int = 1_000_000


class TrainingRun:
    """A training that can be stopped at any moment and goes on from its last checkpoint.

    Attributes:
        trainer: What trains.
        curve: Figures by name at each point, with ``num_steps``.
        torn: Checkpoints that could not be used, each with the reason.
    """

    def __init__(
        self, settings: TrainingSettings, folder: Path, options: RunOptions, device: str = "cpu"
    ) -> None:
        """Begin, or go on with what is in the folder.

        Args:
            settings: What to train, and how.
            folder: Where everything is written.
            options: How to look after it.
            device: Where networks live, as torch names it.

        Raises:
            InvalidInput: If the folder holds a training with other settings.
            CheckpointError: If no checkpoint in it can be used.
        """
        self._folder = folder
        self._options = options
        self._checkpoints = TrainingCheckpoints(folder / CHECKPOINTS)
        self.trainer = Trainer(settings, device)
        self.curve: list[dict[str, float]] = []
        self.torn: tuple[str, ...] = ()
        self._plain = plain_settings(settings)
        if self._checkpoints.numbers():
            self._go_on()

    def run(self, report: Callable[[Progress], None]) -> Path:
        """Train to the end.

        Args:
            report: Told of every rollout.

        Returns:
            File of the weights.
        """
        trainer, weights = self.trainer, self._folder / WEIGHTS
        if trainer.is_done and weights.is_file():
            return weights
        # TensorBoard hides what a run wrote after the checkpoint that it goes on from, or before it had one.
        with SummaryWriter(str(self._folder / EVENTS), purge_step=trainer.num_steps + 1) as writer:
            while not trainer.is_done:
                before = trainer.num_steps
                progress = trainer.advance()
                figures = dict(progress.figures)
                if _passes(before, progress.num_steps, self._options.check_every):
                    figures |= self._check()
                self._log(writer, progress.num_steps, figures)
                report(progress)
                if _passes(before, progress.num_steps, self._options.keep_every):
                    self._keep()
            self._keep()
        return self._write_weights()

    def _go_on(self) -> None:
        restored = self._checkpoints.read()
        state = restored.state
        kept = json.loads(state["settings"])
        if kept != self._plain:
            raise InvalidInput(
                f"{self._folder}: holds a training with other settings; choose another folder, or begin anew with "
                f"--is-fresh. There and here: {'; '.join(differences(kept, self._plain))}"
            )
        self.torn = restored.torn
        self.curve = state["curve"]
        self.trainer.restore(state["trainer"])

    def _keep(self) -> None:
        self._checkpoints.write(
            self.trainer.num_steps,
            {
                "settings": json.dumps(self._plain),
                "curve": [dict(point) for point in self.curve],
                "trainer": self.trainer.state(),
            },
        )
        write_atomically(self._folder / CURVE, (json.dumps(self.curve, indent=0) + "\n").encode())

    def _log(self, writer: SummaryWriter, num_steps: int, figures: Mapping[str, float]) -> None:
        self.curve.append({"num_steps": float(num_steps), **figures})
        for name, value in figures.items():
            writer.add_scalar(name, value, num_steps)

    def _check(self) -> dict[str, float]:
        """Drive the policy through the paper's scenarios, behind the filter that it is trained with, if any."""
        weights = self._weights()
        settings = self.trainer.settings
        figures = {}
        for name in CHECKED:
            row = evaluate_policy(
                lambda navigation: LearnedPolicy.of(weights, navigation),
                load_scenario(name),
                settings.filtering,
                episodes=CHECK_EPISODES,
                seed=CHECK_SEED,
                layout=settings.layout,
            )
            figures[f"success/{name}"] = row.success_rate
            figures[f"social_success/{name}"] = row.social_success_rate
            figures[f"time/{name}"] = row.mean_time
        # NaN: of nobody.
        return {name: value for name, value in figures.items() if math.isfinite(value)}

    def _weights(self) -> Weights:
        settings = self.trainer.settings
        state = as_arrays(self.trainer.learner.networks.state_dict())
        card = Card(
            name=self._options.name,
            data=f"{self.trainer.num_steps} steps of robots in training maps of the town, see docs/scenarios.md.",
            command=self._options.command,
            seed=settings.seed,
            settings=self._plain,
            limits=LIMITS,
            versions={name: version(name) for name in ("safefilter", "numpy", "torch")},
        )
        return Weights(state, settings.layout, card)

    def _write_weights(self) -> Path:
        path = self._folder / WEIGHTS
        write_weights(path, self._weights())
        return path


def clear(folder: Path) -> None:
    """Delete what trainings have written to a folder, and nothing else.

    Args:
        folder: Of a training; it need not exist.
    """
    for pattern in MADE:
        for path in folder.glob(pattern):
            path.unlink()


def _passes(before: int, after: int, every: int) -> bool:
    """Is there a multiple of ``every`` among the numbers after the first, up to the second?"""
    return every > 0 and after // every > before // every
