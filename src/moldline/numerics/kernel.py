"""Compiled kernels as JAX operations: fast on concrete arrays, differentiable, usable in a jit.

A kernel has two forms that agree to rounding: `run`, compiled for the processor, works on NumPy
arrays; `plain`, its definition, is JAX. Outside `jax.jit`, `run` is called on the arrays
themselves, without a copy. Inside a jit it is called back, on other devices `plain` takes over.
Derivatives come from other kernels where the author gives them, else from the plain form, so
that any order and both modes work.
"""

import abc
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from .._types import Array

Arrays = Sequence[Any]


class AbstractKernel(abc.ABC):
    """A function of arrays with a compiled and a plain form; compared and hashed by identity."""

    @abc.abstractmethod
    def run(self, *arrays: np.ndarray) -> tuple[np.ndarray, ...]:
        """The compiled form."""

    @abc.abstractmethod
    def plain(self, *arrays: Array) -> tuple[Array, ...]:
        """The same in JAX."""

    def pushforward(self, arrays: Arrays, tangents: Arrays) -> tuple[Array, ...]:
        """Tangents of the results; by default those of the plain form."""
        return jax.jvp(self.plain, tuple(arrays), tuple(tangents))[1]

    def transpose(self, cotangents: Arrays, arrays: Arrays) -> tuple[Array | None, ...]:
        """Cotangents of those arrays in which the kernel is linear (given as None)."""
        raise NotImplementedError(f"{type(self).__name__} is not linear")

    def __call__(self, *arrays: Any) -> tuple[Array, ...]:
        """The results, by whichever form fits where this is called."""
        return tuple(_operation.bind(*map(_as_argument, arrays), kernel=self))


def _as_argument(array: Any) -> Any:
    return array if isinstance(array, (jax.Array, np.ndarray)) else jnp.asarray(array)


def empty(shape: tuple[int, ...], kind: type[np.floating[Any]] = np.float64) -> np.ndarray:
    """Uninitialised, aligned so that JAX takes it over without a copy."""
    size = np.dtype(kind).itemsize * int(np.prod(shape))
    raw = np.empty(size + 64, np.uint8)
    start = -raw.ctypes.data % 64
    return raw[start : start + size].view(kind).reshape(shape)


def shared(array: np.ndarray) -> jax.Array:
    """The same memory as a JAX array on the CPU."""
    return jax.dlpack.from_dlpack(array)


def _run_now(*arrays: Any, kernel: AbstractKernel) -> list[Any]:
    if all(_is_on_host(array) for array in arrays):
        return [shared(out) for out in kernel.run(*map(np.asarray, arrays))]
    return list(jax.jit(kernel.plain)(*arrays))


def _is_on_host(array: Any) -> bool:
    # arrays of NumPy, and the typed ones that JAX wraps them in, have no device
    return all(d.platform == "cpu" for d in array.devices()) if hasattr(array, "devices") else True


def _shapes(*arrays: Any, kernel: AbstractKernel) -> list[Any]:
    shapes = [jax.ShapeDtypeStruct(a.shape, a.dtype) for a in arrays]
    outs = jax.eval_shape(kernel.plain, *shapes)
    return [jax.core.ShapedArray(out.shape, out.dtype) for out in outs]


def _called_back(*arrays: Any, kernel: AbstractKernel) -> tuple[Array, ...]:
    outs = jax.eval_shape(kernel.plain, *arrays)
    return jax.pure_callback(lambda *given: kernel.run(*map(np.asarray, given)), outs, *arrays)


def _forward(primals: Arrays, tangents: Arrays, *, kernel: AbstractKernel) -> tuple[Any, Any]:
    filled = [ad.instantiate_zeros(t) for t in tangents]
    outs = _operation.bind(*primals, kernel=kernel)
    return outs, list(kernel.pushforward(primals, filled))


def _reverse(cotangents: Arrays, *arrays: Any, kernel: AbstractKernel) -> list[Any]:
    filled = [ad.instantiate_zeros(c) for c in cotangents]
    known = [None if ad.is_undefined_primal(a) else a for a in arrays]
    results = kernel.transpose(filled, known)
    return [r if k is None else None for r, k in zip(results, known, strict=True)]


def _batched(arrays: Arrays, axes: Arrays, *, kernel: AbstractKernel) -> tuple[Any, Any]:
    size = next(a.shape[x] for a, x in zip(arrays, axes, strict=True) if x is not None)

    def pick(array: Any, axis: int | None, i: int) -> Any:
        return array if axis is None else jax.lax.index_in_dim(array, i, axis, keepdims=False)

    columns = [
        kernel(*(pick(a, x, i) for a, x in zip(arrays, axes, strict=True))) for i in range(size)
    ]
    outs = [jnp.stack(out) for out in zip(*columns, strict=True)]
    return outs, [0] * len(outs)


_operation = Primitive("moldline_kernel")
_operation.multiple_results = True
_operation.def_impl(_run_now)
_operation.def_abstract_eval(_shapes)
ad.primitive_jvps[_operation] = _forward
ad.primitive_transposes[_operation] = _reverse
batching.primitive_batchers[_operation] = _batched
mlir.register_lowering(
    _operation,
    mlir.lower_fun(lambda *a, kernel: kernel.plain(*a), multiple_results=True),
)
mlir.register_lowering(
    _operation,
    mlir.lower_fun(_called_back, multiple_results=True),
    platform="cpu",
)
