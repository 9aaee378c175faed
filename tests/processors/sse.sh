# To be sourced: what is started afterwards uses no instruction beyond SSE4.2, as on a processor without AVX and without fused
# multiplications, where sums round otherwise: numba's and saltus's own code, lanes of two numbers, BLAS and NumPy's loops.
# Code compiled in this way has a cache of its own.
export NUMBA_CPU_NAME=nehalem
export NUMBA_CPU_FEATURES="+sse,+sse2,+sse3,+ssse3,+sse4.1,+sse4.2,+popcnt,+cx16,-avx,-avx2,-fma,-avx512f"
export SALTUS_LANES=2
export OPENBLAS_CORETYPE=Nehalem
export NPY_DISABLE_CPU_FEATURES="X86_V3 X86_V4 AVX512_ICL AVX512_SPR" # as NumPy calls them since 2.4
export SALTUS_CACHE_DIR="${XDG_CACHE_HOME:-$HOME/.cache}/saltus-sse"
