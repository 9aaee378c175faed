# To be sourced: what is started afterwards uses no instruction beyond AVX2 and FMA, so that a processor with AVX-512 acts as
# one of a common laptop: numba's and saltus's own code, lanes of four numbers, BLAS and NumPy's loops.
# Code compiled in this way has a cache of its own.
export NUMBA_CPU_NAME=haswell
export NUMBA_CPU_FEATURES="+sse,+sse2,+sse3,+ssse3,+sse4.1,+sse4.2,+popcnt,+cx16,+avx,+avx2,+fma,+bmi,+bmi2,+f16c,-avx512f"
export SALTUS_LANES=4
export OPENBLAS_CORETYPE=Haswell
export NPY_DISABLE_CPU_FEATURES="X86_V4 AVX512_ICL AVX512_SPR" # as NumPy calls them since 2.4
export SALTUS_CACHE_DIR="${XDG_CACHE_HOME:-$HOME/.cache}/saltus-avx2"
