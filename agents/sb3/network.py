"""Network: the small fully connected net of a trained agent, in NumPy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from pkm_gym.core.names import check_known
from pkm_gym.core.reading import check_arrays, shaped
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.observation import observe
from pkm_gym.envs.session import Session

Array = npt.NDArray[np.float32]


def _silu(x: Array) -> Array:
    half: Array = 0.5 * x  # x / (1 + exp(-x)), without an overflow
    return half + half * np.tanh(half)


ACTIVATIONS: dict[str, Callable[[Array], Array]] = {
    "relu": lambda x: np.maximum(x, 0.0),
    "silu": _silu,
    "tanh": np.tanh,
}


class Layer(NamedTuple):
    """Weights (out, in) and biases (out,) of a layer, float32."""

    weight: Array
    bias: Array

    def __call__(self, values: Array) -> Array:
        """Return what the layer makes of values (n, in): array (n, out)."""
        return values @ self.weight.T + self.bias


@dataclass(frozen=True)
class NetworkSettings:
    """What ``Network.settings`` returns."""

    kind: str
    activation: str
    squashed: bool


@dataclass(frozen=True)
class Network:
    """Observations in, the agent's best actions out.

    Attributes:
        layers: in their order.
        activation: between the layers: "relu", "silu" or "tanh".
        squashed: whether the output goes through tanh; otherwise it is clipped to [-1, 1].
    """

    layers: tuple[Layer, ...]
    activation: str
    squashed: bool

    def __post_init__(self) -> None:
        """Refuse an unknown activation.

        Raises:
            ValueError: with the closest match.
        """
        check_known("activation", [self.activation], ACTIVATIONS)

    def __call__(self, observations: Array) -> Array:
        """Return the actions (n, d) in [-1, 1] for observations (n, size)."""
        activate = ACTIVATIONS[self.activation]
        values = observations
        *hidden, last = self.layers
        for layer in hidden:
            values = activate(layer(values))
        values = last(values)
        return np.tanh(values) if self.squashed else np.clip(values, -1.0, 1.0)

    def propose(self, session: Session) -> FloatArray:
        """Return the designs (n, d) that its actions mean in n sessions."""
        actions = self(observe(session.problem, session.tasks, session))
        return session.propose(np.arange(len(actions)), actions.astype(float))

    def settings(self) -> dict[str, Any]:
        """Return what else a file has to hold."""
        return {"kind": "network", "activation": self.activation, "squashed": self.squashed}

    def tensors(self) -> dict[str, Array]:
        """Return weights and biases by name, for a file."""
        return {
            f"{i}.{name}": array
            for i, layer in enumerate(self.layers)
            for name, array in layer._asdict().items()
        }

    @property
    def sizes(self) -> tuple[int, int]:
        """How many numbers it takes and how many it gives."""
        return self.layers[0].weight.shape[1], len(self.layers[-1].bias)

    @classmethod
    def of_tensors(cls, tensors: Mapping[str, Array], settings: Mapping[str, Any]) -> Network:
        """Return the network of what ``tensors()`` and ``settings()`` returned.

        Raises:
            ValueError: in one sentence, for layers that are missing or don't follow each other.
        """
        known = shaped(NetworkSettings, settings, "its network")
        count = max(1, len(tensors) // 2)
        check_arrays(
            tensors,
            {
                f"{i}.{name}": ("f", (f"outputs {i}", f"outputs {i - 1}")[: 2 - (name == "bias")])
                for i in range(count)
                for name in Layer._fields
            },
        )
        layers = tuple(
            Layer(*(tensors[f"{i}.{name}"] for name in Layer._fields)) for i in range(count)
        )
        return cls(layers, known.activation, known.squashed)

    @classmethod
    def of_model(cls, model: Any) -> Network:
        """Return the network that an SB3 model acts with when it doesn't explore."""
        from torch import nn

        policy = model.policy
        if hasattr(policy, "action_net"):  # PPO
            modules = [*policy.mlp_extractor.policy_net, policy.action_net]
        elif hasattr(policy.actor, "latent_pi"):  # SAC, TQC
            modules = [*policy.actor.latent_pi, policy.actor.mu]
        else:  # TD3
            modules = list(policy.actor.mu)
        layers = tuple(
            Layer(_array(module.weight), _array(module.bias))
            for module in modules
            if isinstance(module, nn.Linear)
        )
        names = {type(module).__name__.lower() for module in modules[1:2]}
        return cls(layers, names.pop(), squashed=not hasattr(policy, "action_net"))


def _array(tensor: Any) -> Array:
    array: Array = tensor.detach().cpu().numpy().copy()
    return array
