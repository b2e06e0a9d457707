#pragma once

#include "kernel.hpp"

namespace sdvo {

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
