"""Machine code from LLVM's text, by llvmlite's public binding alone.

The functions of a structure are compiled here, without numba. The object that `object_code` makes may be kept on disk; `Loaded`
puts it into memory. The processor, and what it can do, are those for which numba compiles its functions, so that a kernel and
the functions that it calls round alike.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable
from functools import cache
from typing import Any

import llvmlite
from llvmlite import binding

from saltus.errors import SaltusError

# As numba, and for the whole of LLVM: its passes are not safe to run from two threads of one target machine.
_LLVM = threading.RLock()
_ENGINES: list[Any] = []  # All code stays in memory as long as the process: pointers to it may be anywhere.


def check_environment() -> None:
    """Refuse settings that would make numba fail with its own message when it is imported, or, without its compiler, much later.

    Raises
    ------
    SaltusError
        NUMBA_DISABLE_JIT is set, or NUMBA_NUM_THREADS is no count.
    """
    disabled, threads = os.environ.get("NUMBA_DISABLE_JIT", "0"), os.environ.get("NUMBA_NUM_THREADS", "1")
    if disabled not in ("", "0"):
        raise SaltusError("the environment has NUMBA_DISABLE_JIT set, but saltus is nothing without its compiler; unset it")
    if not (threads.isdecimal() and int(threads) > 0):
        raise SaltusError(f"the environment has NUMBA_NUM_THREADS={threads[:20]!r}, which is no number of threads; unset it")


@cache
def processor() -> tuple[str, str]:
    """The processor's name and the features that may be used, as LLVM writes them."""
    from numba import config  # later, as numba fails where `check_environment` explains

    settings: Any = config
    given = settings.CPU_FEATURES
    return settings.CPU_NAME or binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten() if given is None else given


@cache
def made_for() -> str:
    """All that the same text may be compiled to different code for, as text."""
    return "\n".join((llvmlite.__version__, binding.get_process_triple(), *processor()))


def _target_machine() -> Any:
    """A new machine to compile for; one that an engine runs on belongs to the engine."""
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    name, features = processor()
    target = binding.Target.from_triple(binding.get_process_triple())
    static = target.name.startswith("x86")  # code that is loaded where it stays needs no tables of addresses
    options = {"reloc": "static" if static else "default", "codemodel": "jitdefault", "jit": True}
    return target.create_target_machine(cpu=name, features=features, opt=3, **options)


def object_code(text: str) -> bytes:
    """The object file of LLVM's text, optimised."""
    with _LLVM:
        machine = _target_machine()
        module = binding.parse_assembly(text)
        module.data_layout = str(machine.target_data)
        module.verify()
        _optimise(module, machine)
        made: bytes = machine.emit_object(module)
    return made


def _optimise(module: Any, machine: Any) -> None:
    """LLVM's own passes of level 3; no vectoriser, as the text has vectors where they are worth it."""
    if hasattr(binding, "create_pass_builder"):
        builder = binding.create_pass_builder(machine, binding.create_pipeline_tuning_options(3))
        builder.getModulePassManager().run(module, builder)
        return
    builder = binding.create_pass_manager_builder()  # before llvmlite 0.44
    builder.opt_level = 3
    passes = binding.create_module_pass_manager()
    machine.add_analysis_passes(passes)
    builder.populate(passes)
    passes.run(module)


class Loaded:
    """The functions of an object file in memory, where they stay as long as the process.

    Attributes
    ----------
    addresses
        The address of each function by its name.
    """

    def __init__(self, code: bytes, names: Iterable[str]) -> None:
        with _LLVM:
            self._engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _target_machine())
            self._engine.add_object_file(binding.ObjectFileRef.from_data(code))
            self._engine.finalize_object()
            _ENGINES.append(self._engine)
            self.addresses: dict[str, int] = {name: self._engine.get_function_address(name) for name in names}
