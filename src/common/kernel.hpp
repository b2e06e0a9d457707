#pragma once

#include "stereo_descriptor_vo/common/processor.hpp"

#if defined(__x86_64__) && defined(__GNUC__)
#define SDVO_HAVE_AVX2
/// For functions that may use AVX2's instructions; to be called only where usesVectorKernels().
#define SDVO_AVX2 __attribute__((target("avx2")))
#elif defined(__aarch64__) && defined(__ARM_NEON)
/// Every such processor has it: kernels need no second compilation. To be called only where usesVectorKernels().
#define SDVO_HAVE_NEON
#endif
#if defined(SDVO_HAVE_AVX2) || defined(SDVO_HAVE_NEON)
#define SDVO_HAVE_VECTORS
#endif
/// For functions that are compiled for either.
#ifdef SDVO_HAVE_AVX2
#define SDVO_VECTORS SDVO_AVX2
#else
#define SDVO_VECTORS
#endif
/// For kernels and their parts: they are compiled anew for the processor of each function that they become a part of.
#define SDVO_IN_KERNEL inline __attribute__((always_inline))

namespace sdvo {

#ifdef SDVO_HAVE_AVX2
template <class Kernel, class... Arguments>
SDVO_AVX2 void runWithAvx2(Arguments... arguments) {
  Kernel::run(arguments...);
}
#endif

/// Runs Kernel::run(arguments...), a function SDVO_IN_KERNEL, in the version for this processor.
template <class Kernel, class... Arguments>
void runKernel(Arguments... arguments) {
#ifdef SDVO_HAVE_AVX2
  if (usesVectorKernels()) return runWithAvx2<Kernel>(arguments...);
#endif
  Kernel::run(arguments...);
}

}  // namespace sdvo
