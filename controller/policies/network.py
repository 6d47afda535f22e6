"""A small network, fitted by Adam, and written as an ONNX file.

    y = W3 tanh(W2 tanh(W1 x + b1) + b2) + b3

Inputs and outputs are normalised by mean and standard deviation during the fit; the network in the
file has both in its first and last layer. Adam: Kingma and Ba 2015, algorithm 1.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float

from go2_wbc.errors import needing

BETA = 0.9, 0.999  #: Of Adam's means of the gradient, and of its square
LEAST_DEVIATION = 1e-3  #: Of an input: what never changes is not blown up
BATCH = 512

Samples = Float[np.ndarray, "k n"]
Labels = Float[np.ndarray, "k m"]


class Network:
    """Layers of tanh between an input and an output.

    Attributes:
        parts: weights and biases, which a fit changes in place.
    """

    def __init__(self, sizes: tuple[int, ...], rng: np.random.Generator) -> None:
        """Random weights (Glorot and Bengio 2010) of layers with these numbers of units."""
        self._weights = [
            rng.normal(scale=np.sqrt(2.0 / (m + n)), size=(m, n)) for m, n in pairwise(sizes)
        ]
        self._biases = [np.zeros(n) for n in sizes[1:]]
        self._mean, self._deviation = np.zeros(sizes[0]), np.ones(sizes[0])
        self.parts = [*self._weights, *self._biases]
        self._rng, self._is_fitted = rng, False

    def __call__(self, x: Float[np.ndarray, "*k n"]) -> Float[np.ndarray, "*k m"]:
        """The outputs of inputs."""
        return self._layers((x - self._mean) / self._deviation)[-1]

    def _layers(self, x: Float[np.ndarray, "*k n"]) -> list[Float[np.ndarray, "*k _"]]:
        layers = [x]
        for i, (W, b) in enumerate(zip(self._weights, self._biases, strict=True)):
            y = layers[-1] @ W + b
            layers.append(y if i == len(self._weights) - 1 else np.tanh(y))
        return layers

    def fit(self, x: Samples, y: Labels, steps: int, rate: float = 2e-3) -> float:
        """Lower the mean square error of ``y``; the rate falls to 0 by a cosine.

        Returns:
            The mean square error over the last tenth of the steps.
        """
        self._normalise(x)
        x = (x - self._mean) / self._deviation
        means, squares = ([np.zeros_like(p) for p in self.parts] for _ in range(2))
        errors = [0.0]
        for done in range(1, steps + 1):
            rows = self._rng.integers(len(x), size=BATCH)
            loss, gradients = self.gradients(x[rows], y[rows])
            errors.append(loss)
            step = 0.5 * rate * (1.0 + np.cos(np.pi * done / steps))
            for part, g, mean, square in zip(self.parts, gradients, means, squares, strict=True):
                mean += (1.0 - BETA[0]) * (g - mean)
                square += (1.0 - BETA[1]) * (g * g - square)
                unbiased = np.sqrt(square / (1.0 - BETA[1] ** done)) + 1e-8
                part -= step * mean / (1.0 - BETA[0] ** done) / unbiased
        return float(np.mean(errors[-max(steps // 10, 1) :]))

    def _normalise(self, x: Samples) -> None:
        """Take the inputs by their mean and deviation; what was fitted before computes the same."""
        mean, deviation = x.mean(axis=0), np.maximum(x.std(axis=0), LEAST_DEVIATION)
        if not self._is_fitted:
            self._mean, self._deviation, self._is_fitted = mean, deviation, True
            return
        self._biases[0] += ((mean - self._mean) / self._deviation) @ self._weights[0]
        self._weights[0] *= (deviation / self._deviation)[:, None]
        self._mean, self._deviation = mean, deviation

    def gradients(self, x: Samples, y: Labels) -> tuple[float, list[Float[np.ndarray, "..."]]]:
        """Mean square error of normalised inputs, and its gradients: of weights, then biases."""
        layers = self._layers(x)
        off = layers[-1] - y
        delta, weights, biases = 2.0 * off / off.size, [], []
        for W, layer in zip(self._weights[::-1], layers[-2::-1], strict=True):
            weights.append(layer.T @ delta)
            biases.append(delta.sum(axis=0))
            delta = (delta @ W.T) * (1.0 - layer**2)
        return float(np.mean(off**2)), [*weights[::-1], *biases[::-1]]

    def save(self, path: Path) -> None:
        """Write it as an ONNX file, in single precision.

        Raises:
            MissingDependency: without the extra ``policies``; names the install line.
        """
        with needing("policies", "writing a network needs onnx"):
            from onnx import TensorProto, helper, numpy_helper
        weights, biases = [W.copy() for W in self._weights], [b.copy() for b in self._biases]
        weights[0] /= self._deviation[:, None]
        biases[0] -= self._mean @ weights[0]
        nodes, numbers, name = [], [], "observation"
        for i, (W, b) in enumerate(zip(weights, biases, strict=True)):
            numbers.append(numpy_helper.from_array(W.astype(np.float32), f"W{i}"))
            numbers.append(numpy_helper.from_array(b.astype(np.float32), f"b{i}"))
            is_last = i == len(weights) - 1
            into = "action" if is_last else f"y{i}"
            nodes.append(helper.make_node("Gemm", [name, f"W{i}", f"b{i}"], [into]))
            name = into
            if not is_last:
                nodes.append(helper.make_node("Tanh", [name], [f"h{i}"]))
                name = f"h{i}"
        real = TensorProto.FLOAT
        ends = [
            helper.make_tensor_value_info(name, real, [1, size])
            for name, size in (("observation", len(weights[0])), ("action", len(biases[-1])))
        ]
        graph = helper.make_graph(nodes, "policy", ends[:1], ends[1:], numbers)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
        model.ir_version = 9
        path.write_bytes(model.SerializeToString())
