#pragma once

#include <atomic>

#if defined(__x86_64__) && defined(__GNUC__)
#define SDVO_HAVE_AVX2
/// For functions that may use AVX2's instructions; to be called only where usesVectorKernels().
#define SDVO_AVX2 __attribute__((target("avx2")))
#elif defined(__aarch64__) && defined(__ARM_NEON)
/// Every 64-bit ARM processor has NEON, so kernels are compiled once. Functions that use it are called only where
/// usesVectorKernels().
#define SDVO_HAVE_NEON
#endif
/// For kernels and their parts: always inlined, so each is compiled for the target of its caller.
#define SDVO_IN_KERNEL inline __attribute__((always_inline))

namespace sdvo {

// The kernels that take most of the time are compiled twice: for any processor, and for AVX2. Those by intrinsics have
// a plain form beside them. One of both is chosen at run time, and both give the same bits: sums are added in a fixed
// order, and no product is fused with a sum.

/// Whether this processor has the vectors that kernels use. All 64-bit ARM processors have NEON, not all of x86 AVX2.
inline bool processorHasVectors() {
#ifdef SDVO_HAVE_AVX2
  return __builtin_cpu_supports("avx2");
#elif defined(SDVO_HAVE_NEON)
  return true;
#else
  return false;
#endif
}

inline std::atomic<bool> vector_kernels_in_use{processorHasVectors()};

inline bool usesVectorKernels() {
  return vector_kernels_in_use.load(std::memory_order_relaxed);
}

/// False: plain kernels from now on. True: vectors again, if the processor has them. For tests and benchmarks.
inline void allowVectorKernels(bool allowed) {
  vector_kernels_in_use = allowed && processorHasVectors();
}

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

/// Eight floats worked on at once: one register with AVX, two without. A compiler may not vectorise a plain sum of
/// floats, because that changes the order of the additions. Lanes fix the order, so all processors give the same sum.
typedef float Lanes __attribute__((vector_size(32)));
/// Four doubles, in the same registers.
typedef double DoubleLanes __attribute__((vector_size(32)));

/// Lanes at an address that need not be aligned. Read by one instruction; gcc 9 turns memcpy into a detour by the
/// stack.
template <class Vector>
struct __attribute__((packed, may_alias)) Unaligned {
  Vector lanes;
};

template <class Number, class Vector>
SDVO_IN_KERNEL void load(const Number* values, Vector& lanes) {
  lanes = reinterpret_cast<const Unaligned<Vector>*>(values)->lanes;
}

template <class Number, class Vector>
SDVO_IN_KERNEL void store(const Vector& lanes, Number* values) {
  reinterpret_cast<Unaligned<Vector>*>(values)->lanes = lanes;
}

/// The sum of all lanes in a fixed order: the two halves, then across.
SDVO_IN_KERNEL float sumOf(const Lanes& lanes) {
  typedef float HalfLanes __attribute__((vector_size(16)));
  const HalfLanes low = {lanes[0], lanes[1], lanes[2], lanes[3]}, high = {lanes[4], lanes[5], lanes[6], lanes[7]};
  const HalfLanes sums = low + high;
  return (sums[0] + sums[2]) + (sums[1] + sums[3]);
}

/// Sums of the products of three numbers, each with each.
template <class Number>
struct Products {
  Number aa{}, ab{}, ac{}, bb{}, bc{}, cc{};

  SDVO_IN_KERNEL void add(const Number& a, const Number& b, const Number& c) {
    aa += a * a, ab += a * b, ac += a * c;
    bb += b * b, bc += b * c, cc += c * c;
  }
};

SDVO_IN_KERNEL Products<float> sumOf(const Products<Lanes>& lanes) {
  return {sumOf(lanes.aa), sumOf(lanes.ab), sumOf(lanes.ac), sumOf(lanes.bb), sumOf(lanes.bc), sumOf(lanes.cc)};
}

}  // namespace sdvo
