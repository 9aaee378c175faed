"""Where the code of a thread runs: on a card, by its driver, or on this processor.

On this processor the threads run one after the other: so the same text is followed where there is no
card, by tests. Cards are reached by `cuda-bindings` (the extra `cuda`); only functions of the driver
are called, so that no toolkit is needed.
"""

from __future__ import annotations

import ctypes
from typing import Any, Protocol

import numpy as np
from llvmlite import binding

from saltus.errors import SaltusError
from saltus.flow.cuda.thread_code import BLOCK, BLOCKS, machine

ARENA = 1 << 17  # bytes of a thread, for the arrays of the scalar kernel
SHARE = 0.25  # of the card's free memory that one launch takes


class Target(Protocol):
    """A machine that runs the code of a thread; all arrays are given by their addresses there."""

    name: str
    card: bool
    memory: float  # bytes that the arrays of a launch may take

    def load(self, code: bytes) -> Any:
        """The code, ready to run."""

    def put(self, array: np.ndarray) -> int:
        """Copy an array there; returns its address."""

    def room(self, size: int) -> int:
        """Room for so many bytes there; returns its address."""

    def get(self, address: int, array: np.ndarray) -> None:
        """Copy an array back."""

    def free(self) -> None:
        """Forget all arrays."""

    def follow(self, loaded: Any, request: np.ndarray, count: int) -> None:
        """Run the threads of a request of so many motions, until all have returned."""


class Host:
    """This processor."""

    name = "this processor, one lane at a time"
    card = False
    memory = 1e9

    def __init__(self) -> None:
        self._arrays: list[np.ndarray] = []
        self._loaded: dict[bytes, Any] = {}
        self._arena = np.zeros(ARENA // 8, dtype=np.int64)

    def load(self, code: bytes) -> Any:
        if code not in self._loaded:
            self._loaded[code] = self._load(code)
        return self._loaded[code]

    def _load(self, code: bytes) -> Any:
        engine = binding.create_mcjit_compiler(binding.parse_assembly(""), machine(False))
        engine.add_object_file(binding.ObjectFileRef.from_data(code))
        engine.finalize_object()
        for name, value in (("arenas", self._arena.ctypes.data), ("arena_size", ARENA)):
            ctypes.c_int64.from_address(engine.get_global_value_address(name)).value = value
        kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)
        return engine, kind(engine.get_function_address("follow"))

    def put(self, array: np.ndarray) -> int:
        self._arrays.append(array)
        return int(array.ctypes.data)

    def room(self, size: int) -> int:
        return self.put(np.empty(-(-size // 8), dtype=np.int64))

    def get(self, address: int, array: np.ndarray) -> None:
        pass  # it is there

    def free(self) -> None:
        self._arrays.clear()

    def follow(self, loaded: Any, request: np.ndarray, count: int) -> None:
        loaded[1](request.ctypes.data, 0, 1)


class Card:
    """The first card that the driver names."""

    card = True

    def __init__(self) -> None:
        try:
            from cuda.bindings import driver
        except ImportError:
            raise SaltusError(
                'motions on a card need the package cuda-bindings: pip install ".[cuda]"'
            ) from None
        self._driver: Any = driver
        self._arrays: list[Any] = []
        self._loaded: dict[bytes, Any] = {}
        self._ask("no card was found", driver.cuInit, 0)
        self._device = self._ask("no card was found", driver.cuDeviceGet, 0)
        attribute = driver.CUdevice_attribute
        oldest = self._attribute(attribute.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR)
        self.name = self._ask("the card has no name", driver.cuDeviceGetName, 100, self._device)
        self.name = self.name.split(b"\0")[0].decode()
        if oldest < 8:
            raise SaltusError(f"{self.name} is too old: cards from 2020 on are needed (sm_80)")
        self.slow = self._attribute(
            attribute.CU_DEVICE_ATTRIBUTE_SINGLE_TO_DOUBLE_PRECISION_PERF_RATIO
        )
        self._context = self._ask("the card is busy", driver.cuDevicePrimaryCtxRetain, self._device)
        self._ask("the card is busy", driver.cuCtxSetCurrent, self._context)
        processors = self._attribute(attribute.CU_DEVICE_ATTRIBUTE_MULTIPROCESSOR_COUNT)
        self._threads = processors * BLOCKS * BLOCK
        self.free_memory, _ = self._ask("the card is busy", driver.cuMemGetInfo)
        self.memory = SHARE * self.free_memory
        self._threads = min(self._threads, int(self.memory) // ARENA // BLOCK * BLOCK)
        self._arenas = self._ask(
            "the card's memory is full", driver.cuMemAlloc, self._threads * ARENA
        )

    def _ask(self, problem: str, function: Any, *arguments: Any) -> Any:
        """What a function of the driver gives.

        Raises
        ------
        SaltusError
            It fails, or there is no driver.
        """
        try:
            error, *results = function(*arguments)
        except RuntimeError:  # the library of the driver is not there
            raise SaltusError(f"{problem}: this machine has no driver of NVIDIA's") from None
        if int(error) != 0:
            raise SaltusError(f"{problem}: {getattr(error, 'name', error)}")
        return results[0] if len(results) == 1 else results

    def _attribute(self, which: Any) -> int:
        return int(
            self._ask("no card was found", self._driver.cuDeviceGetAttribute, which, self._device)
        )

    def load(self, code: bytes) -> Any:
        driver = self._driver
        self._ask("the card is busy", driver.cuCtxSetCurrent, self._context)  # of this thread
        if code not in self._loaded:
            self._loaded[code] = self._load(code)
        return self._loaded[code]

    def _load(self, code: bytes) -> Any:
        driver = self._driver
        module = self._ask("the driver refuses the code", driver.cuModuleLoadData, code + b"\0")
        for name, value in ((b"arenas", int(self._arenas)), (b"arena_size", ARENA)):
            word = np.array([value], dtype=np.int64)
            place, _ = self._ask("the code is damaged", driver.cuModuleGetGlobal, module, name)
            self._copy_to(place, word)
        return self._ask("the code is damaged", driver.cuModuleGetFunction, module, b"follow_all")

    def _copy_to(self, place: Any, array: np.ndarray) -> None:
        driver = self._driver
        problem = "an array could not be copied to the card"
        self._ask(problem, driver.cuMemcpyHtoD, place, array.ctypes.data, array.nbytes)

    def put(self, array: np.ndarray) -> int:
        place = self.room(array.nbytes)
        if array.nbytes:
            self._copy_to(place, array)
        return place

    def room(self, size: int) -> int:
        place = self._ask("the card's memory is full", self._driver.cuMemAlloc, max(8, size))
        self._arrays.append(place)
        return int(place)

    def get(self, address: int, array: np.ndarray) -> None:
        problem = "an array could not be copied from the card"
        if array.nbytes:
            self._ask(problem, self._driver.cuMemcpyDtoH, array.ctypes.data, address, array.nbytes)

    def free(self) -> None:
        for place in self._arrays:
            self._ask("the card does not answer", self._driver.cuMemFree, place)
        self._arrays.clear()

    def follow(self, loaded: Any, request: np.ndarray, count: int) -> None:
        driver = self._driver
        words = self.put(request)
        blocks = -(-min(count, self._threads) // BLOCK)
        arguments = ((words,), (ctypes.c_void_p,))
        problem = "the card has failed"
        grid = (blocks, 1, 1, BLOCK, 1, 1, 0, 0)
        self._ask(problem, driver.cuLaunchKernel, loaded, *grid, arguments, 0)
        self._ask(problem, driver.cuCtxSynchronize)
