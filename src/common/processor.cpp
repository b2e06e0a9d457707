#include "processor.hpp"

#include <atomic>

#include "kernel.hpp"

namespace sdvo {
namespace {

bool processorHasVectors() {
#ifdef SDVO_HAVE_AVX2
  return __builtin_cpu_supports("avx2");
#elif defined(SDVO_HAVE_NEON)
  return true;
#else
  return false;
#endif
}

std::atomic<bool> uses_vectors{processorHasVectors()};

}  // namespace

bool usesVectorKernels() {
  return uses_vectors.load(std::memory_order_relaxed);
}

void allowVectorKernels(bool allowed) {
  uses_vectors = allowed && processorHasVectors();
}

}  // namespace sdvo
