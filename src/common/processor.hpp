#pragma once

namespace sdvo {

// The kernels that take most of the time are compiled twice: for any processor, and for AVX2. Those by intrinsics have
// a plain form beside them. One of both is chosen at run time, and both give the same bits: sums are added in a fixed
// order, and no product is fused with a sum.

/// Whether kernels use vectors. All 64-bit ARM processors have NEON, not all of x86 have AVX2.
bool usesVectorKernels();

/// False: plain kernels from now on. True: vectors again, if the processor has them. For tests and benchmarks.
void allowVectorKernels(bool allowed);

}  // namespace sdvo
