"""The network's gradients are those of finite differences; what is written computes the same."""

from pathlib import Path

import numpy as np
import onnxruntime

from controller.policies.network import Network

SINGLE = 1e-5  # of numbers near 1 in single precision, through three layers


def test_the_gradients_are_those_of_finite_differences() -> None:
    rng = np.random.default_rng(1)
    network = Network((5, 7, 6, 3), rng)
    x, y = rng.normal(size=(8, 5)), rng.normal(size=(8, 3))
    _, gradients = network.gradients(x, y)
    h = 1e-6
    for part, gradient in zip(network.parts, gradients, strict=True):
        for place in np.ndindex(part.shape):
            kept = part[place]
            part[place] = kept + h
            above = network.gradients(x, y)[0]
            part[place] = kept - h
            below = network.gradients(x, y)[0]
            part[place] = kept
            np.testing.assert_allclose(gradient[place], (above - below) / (2.0 * h), atol=1e-7)


def test_a_fit_learns_a_function_of_inputs_of_any_size() -> None:
    rng = np.random.default_rng(2)
    x = rng.normal(size=(2000, 3)) * [1.0, 100.0, 0.01] + [0.0, 500.0, 3.0]
    y = np.column_stack([np.sin(x[:, 0]), (x[:, 1] - 500.0) / 100.0 * x[:, 0]])
    network = Network((3, 32, 32, 2), rng)
    error = network.fit(x, y, 1500)
    assert error < 0.01 * y.var()
    assert np.mean((network(x) - y) ** 2) < 2.0 * error


def test_a_fit_on_other_inputs_begins_with_the_function_that_was_there() -> None:
    rng = np.random.default_rng(3)
    network = Network((3, 16, 2), rng)
    x = rng.normal(size=(600, 3)) * [1.0, 5.0, 0.2]
    network.fit(x, rng.normal(size=(600, 2)), 20)
    before = network(x)
    network.fit(3.0 * x + 1.0, rng.normal(size=(600, 2)), 0)
    np.testing.assert_allclose(network(x), before, atol=1e-9)


def test_the_file_computes_what_the_network_does(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    network = Network((4, 16, 16, 12), rng)
    x = rng.normal(size=(100, 4)) * [1.0, 10.0, 0.1, 1.0] + 2.0
    network.fit(x, rng.normal(size=(100, 12)), 50)
    network.save(tmp_path / "n.onnx")
    session = onnxruntime.InferenceSession(str(tmp_path / "n.onnx"))
    for row in x[:10]:
        (action,) = session.run(None, {"observation": row.astype(np.float32)[None]})
        np.testing.assert_allclose(np.asarray(action)[0], network(row), atol=SINGLE)
