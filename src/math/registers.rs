//! The upper halves of the vector registers, which products of faer leave in use.
//!
//! faer 0.24 multiplies by private-gemm-x86 0.1, whose kernels return without `vzeroupper`. On processors of Intel each
//! change between code in the two encodings then waits (Intel, 64 and IA-32 Architectures Optimization Reference
//! Manual, mixing of AVX and SSE): an `exp` of the C library takes 122 ns in place of 3, and the diagnosis of a drive
//! 1.5 to 2 times as long.

use std::hint::black_box;

/// Frees the upper halves after a product or factorisation by faer; the compiler ends what it writes in wide registers
/// by doing so.
pub(crate) fn free_upper_halves() {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            let mut wide = black_box([1.0_f64; 8]);
            wide.iter_mut().for_each(|x| *x += 1.0);
            black_box(wide);
        },
    );
}
