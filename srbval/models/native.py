"""Calls of kernels: machine code, loaded from memory and called without numba, whose import takes 0.2 s."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

ENTRY = "kernel"  # name of the function that `load` calls, see `add_entry`
SUCCEEDED = (0, -2)  # status with which numba's functions return; -2: no result
SLOT = "=q"  # every number and pointer takes 8 bytes
NUMBER_FORMATS: dict[type, str] = {bool: SLOT, int: SLOT, np.int64: SLOT, float: "=d", np.float64: "=d"}


def pack(value: Any) -> tuple[str, bytes]:
    """Write an argument of a kernel as the machine code reads it: its form, which names its types, and its bytes.

    Arrays are passed by their address, as numba lays them out: two pointers that kernels do not use, number of
    elements, bytes of an element, address, shape and strides. Tuples, also nested ones, follow element by element. The
    arrays must live until the kernel returns. Raises TypeError for other types.
    """
    if isinstance(value, np.ndarray):
        order = "C" if value.flags.c_contiguous else "F" if value.flags.f_contiguous else "A"
        form = f"{value.dtype.str}{value.ndim}{order}{value.flags.aligned:d}{value.flags.writeable:d}"
        numbers = (0, 0, value.size, value.itemsize, value.__array_interface__["data"][0], *value.shape, *value.strides)
        return form, struct.pack(f"={len(numbers)}q", *numbers)
    if isinstance(value, tuple):
        forms, contents = zip(*map(pack, value), strict=True) if value else ((), ())
        return f"{type(value).__name__}({','.join(forms)})", b"".join(contents)
    if value is None:
        return "None", bytes(8)
    kind = type(value)
    if kind not in NUMBER_FORMATS:
        raise TypeError(f"a kernel takes arrays, numbers, None and tuples of these, not {kind.__name__}")
    return np.dtype(kind).str, struct.pack(NUMBER_FORMATS[kind], value)


class Kernel:
    """A function that is called as machine code; `compiled(form, arguments)` returns this code when it is needed.

    Its arguments are arrays, which it may change, numbers, None and tuples of these; it returns nothing. Other threads
    run while it runs. `form` names the types of the arguments. Raises RuntimeError if the machine code fails.
    """

    def __init__(self, name: str, compiled: Callable[[str, tuple[Any, ...]], bytes]) -> None:
        self.__name__, self._compiled = name, compiled
        self._entries: dict[str, Callable[[bytes], int]] = {}
        self._packed: dict[int, tuple[Any, tuple[str, bytes]]] = {}

    def __call__(self, *arguments: Any) -> None:
        """Run the kernel."""
        forms, contents = zip(*map(self._pack, range(len(arguments)), arguments), strict=True)
        form = ",".join(forms)
        if form not in self._entries:
            self._entries[form] = load(self._compiled(form, arguments))
        status = self._entries[form](b"".join(contents))
        if status not in SUCCEEDED:
            raise RuntimeError(f"the kernel {self.__name__} failed with the status {status}")

    def _pack(self, place: int, value: Any) -> tuple[str, bytes]:
        """Pack the argument in a place; a tuple that was passed there in the last call is not packed again."""
        known, packed = self._packed.get(place, (None, ("", b"")))
        if known is None or known is not value:
            packed = pack(value)
            if isinstance(value, tuple):
                self._packed[place] = value, packed
        return packed


def load(machine_code: bytes) -> Any:
    """Load an object file (ELF, COFF or Mach-O) into memory; the result calls its function `ENTRY` with packed bytes.

    Each object file has an engine of its own, because functions of the same name may differ in their last digits.
    """
    from llvmlite import binding

    engine = binding.create_mcjit_compiler(binding.parse_assembly(""), _target().create_target_machine(jit=True))
    engine.add_object_file(binding.ObjectFileRef.from_data(machine_code))
    engine.finalize_object()
    call: Any = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_char_p)(engine.get_function_address(ENTRY))
    call.engine = engine  # which the machine code needs as long as it is called
    return call


@cache
def _target() -> Any:
    """Processor and system for which LLVM loads object files: those of this machine."""
    from llvmlite import binding

    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    return binding.Target.from_triple(binding.get_process_triple())


def add_entry(library: Any, context: Any, function: Any) -> None:
    """Add the function `ENTRY` to a library of numba: it reads packed arguments and calls the compiled `function`.

    `context`: numba's target context; `function`: descriptor of the compiled function. See `pack` for the arguments.
    """
    from llvmlite import ir

    module, convention = context.create_module(ENTRY), context.call_conv
    called_type = convention.get_function_type(function.restype, function.argtypes)
    called = ir.Function(module, called_type, function.llvm_func_name)
    slot = ir.IntType(64)
    entry = ir.Function(module, ir.FunctionType(ir.IntType(32), [slot.as_pointer()]), ENTRY)
    builder = ir.IRBuilder(entry.append_basic_block("entry"))
    packer = convention._get_arg_packer(function.argtypes)
    flat = []
    for number, kind in enumerate(packer.argument_types):
        value = builder.load(builder.gep(entry.args[0], [ir.IntType(32)(number)]))
        if isinstance(kind, ir.PointerType):
            value = builder.inttoptr(value, kind)
        elif isinstance(kind, ir.IntType):
            value = builder.trunc(value, kind) if kind.width < slot.width else value
        else:
            value = builder.bitcast(value, kind)
        flat.append(value)
    arguments = packer.from_arguments(builder, tuple(flat))
    status, _ = convention.call_function(
        builder, called, function.restype, function.argtypes, arguments, attrs=("noinline",)
    )
    builder.ret(status.code)
    library.add_ir_module(module)
