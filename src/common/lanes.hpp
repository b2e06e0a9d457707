#pragma once

#include <cstring>

#include "kernel.hpp"

namespace sdvo {

/// Eight floats worked on at once: one register with AVX, two without. A plain loop over floats may not be summed up in
/// parallel, as that changes the order of the additions; here the order is written down.
typedef float Lanes __attribute__((vector_size(32)));
/// Half of them, for what is left at the end.
typedef float HalfLanes __attribute__((vector_size(16)));
/// Four doubles, in the same registers.
typedef double DoubleLanes __attribute__((vector_size(32)));

template <class Number, class Vector>
SDVO_IN_KERNEL void load(const Number* values, Vector& lanes) {
  std::memcpy(&lanes, values, sizeof(Vector));
}

template <class Number, class Vector>
SDVO_IN_KERNEL void store(const Vector& lanes, Number* values) {
  std::memcpy(values, &lanes, sizeof(Vector));
}

/// The sum of all lanes, those of the rest added after the halves.
SDVO_IN_KERNEL float sumOf(const Lanes& lanes, const HalfLanes& rest = HalfLanes{}) {
  const HalfLanes low = {lanes[0], lanes[1], lanes[2], lanes[3]}, high = {lanes[4], lanes[5], lanes[6], lanes[7]};
  const HalfLanes sums = (low + high) + rest;
  return (sums[0] + sums[2]) + (sums[1] + sums[3]);
}

}  // namespace sdvo
