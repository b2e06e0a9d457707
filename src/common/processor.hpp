#pragma once

namespace sdvo {

// The kernels in which most of the time goes by exist twice, in plain C++ and with vectors of AVX2 or NEON, and are
// chosen while running. Both give the same bits: sums are added in a fixed order, and no product is fused with a sum.

/// Whether kernels use vectors. All 64-bit ARM processors have NEON, not all of x86 have AVX2.
bool usesVectorKernels();

/// The plain forms from now on, or vectors again where the processor has them: for tests and benchmarks that compare.
void allowVectorKernels(bool allowed);

}  // namespace sdvo
