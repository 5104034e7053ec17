// How hot loops get the instructions of the machine they run on.

#pragma once

/// Marks a plain function whose loops the compiler vectorises: it is built for AVX-512, AVX2 and
/// for the baseline, and the fitting version is picked when the program starts. Nothing happens
/// where the compiler has no such feature; the code is then built for the baseline alone.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define HAARLIGHT_MULTIVERSION __attribute__((target_clones("avx512f", "arch=haswell", "default")))
#else
#define HAARLIGHT_MULTIVERSION
#endif
