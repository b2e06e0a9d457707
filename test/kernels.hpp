#pragma once

#include <gtest/gtest.h>

#include "../src/common/kernel.hpp"

namespace sdvo {

/// Calls `use` with vector kernels, where the processor has them, and with plain ones.
template <class Use>
void withEveryKernel(const Use& use) {
  for (const bool with_vectors : {true, false}) {
    const ::testing::ScopedTrace trace(__FILE__, __LINE__, with_vectors ? "with vectors" : "without vectors");
    allowVectorKernels(with_vectors);
    use();
  }
  allowVectorKernels(true);
}

/// The result of a computation, which every kernel is expected to give to the bit.
template <class Compute>
auto ofEveryKernel(const Compute& compute) {
  allowVectorKernels(false);
  const auto plain = compute();
  allowVectorKernels(true);
  EXPECT_EQ(compute(), plain);
  return plain;
}

}  // namespace sdvo
