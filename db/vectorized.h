// A mark for inner loops: compiled once per vector width, the widest that the machine has is used.
#pragma once

// Widths change speed alone: no operation is contracted or reordered (-ffp-contract=off), so the bits are the
// same.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define PATCHWORK_VECTORIZED __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define PATCHWORK_VECTORIZED
#endif
