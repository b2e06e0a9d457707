#pragma once

namespace sdvo {

// The kernels in which most of the time goes by exist twice, for processors with AVX2 and for all others, and are
// chosen while running. Both give the same bits: sums are added in a fixed order, and no product is fused with a sum.

/// Whether kernels use AVX2.
bool usesAvx2();

/// Without AVX2 from now on, or with it again where the processor has it: for tests and benchmarks that compare both.
void allowAvx2(bool allowed);

}  // namespace sdvo
