#include "stereo_descriptor_vo/common/processor.hpp"

#include <atomic>

#include "kernel.hpp"

namespace sdvo {
namespace {

bool processorHasAvx2() {
#ifdef SDVO_HAVE_AVX2
  return __builtin_cpu_supports("avx2");
#else
  return false;
#endif
}

std::atomic<bool> uses_avx2{processorHasAvx2()};

}  // namespace

bool usesAvx2() {
  return uses_avx2.load(std::memory_order_relaxed);
}

void allowAvx2(bool allowed) {
  uses_avx2 = allowed && processorHasAvx2();
}

}  // namespace sdvo
