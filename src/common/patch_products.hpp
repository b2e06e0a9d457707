#pragma once

#include "kernel.hpp"

namespace sdvo {

// Kernels on patches: arrays of `count` floats, a multiple of four.

/// Subtracts the mean where the mask is 1; where it is 0, values are 0. `pixels` is the sum of the mask.
struct RemoveMean {
  template <class Vector>
  static SDVO_IN_KERNEL void add(const float* values, Vector& sum) {
    Vector v;
    load(values, v);
    sum += v;
  }
  template <class Vector>
  static SDVO_IN_KERNEL void subtract(float mean, const float* mask, float* values) {
    Vector v, m;
    load(values, v), load(mask, m);
    v -= mean * m;
    store(v, values);
  }

  static SDVO_IN_KERNEL void run(int count, float pixels, const float* mask, float* values) {
    Lanes whole{};
    HalfLanes rest{};
    int i = 0;
    for (; i + 8 <= count; i += 8) add(values + i, whole);
    if (i < count) add(values + i, rest);
    const float mean = sumOf(whole, rest) / pixels;
    for (i = 0; i + 8 <= count; i += 8) subtract<Lanes>(mean, mask + i, values + i);
    if (i < count) subtract<HalfLanes>(mean, mask + i, values + i);
  }
};

/// Sums of the products of arrays a, b and c, each with each.
template <class Vector>
struct Products {
  Vector aa{}, ab{}, ac{}, bb{}, bc{}, cc{};

  SDVO_IN_KERNEL void add(const Vector& a, const Vector& b, const Vector& c) {
    aa += a * a, ab += a * b, ac += a * c;
    bb += b * b, bc += b * c, cc += c * c;
  }
};

using LaneProducts = Products<float>;

SDVO_IN_KERNEL LaneProducts sumOf(const Products<Lanes>& whole, const Products<HalfLanes>& rest) {
  return {sumOf(whole.aa, rest.aa), sumOf(whole.ab, rest.ab), sumOf(whole.ac, rest.ac),
          sumOf(whole.bb, rest.bb), sumOf(whole.bc, rest.bc), sumOf(whole.cc, rest.cc)};
}

/// Sums of the products of three arrays.
struct SumProducts {
  template <class Vector>
  static SDVO_IN_KERNEL void add(const float* a, const float* b, const float* c, Products<Vector>& sums) {
    Vector u, v, w;
    load(a, u), load(b, v), load(c, w);
    sums.add(u, v, w);
  }

  static SDVO_IN_KERNEL void run(int count, const float* a, const float* b, const float* c, LaneProducts* sums) {
    Products<Lanes> whole;
    Products<HalfLanes> rest;
    int i = 0;
    for (; i + 8 <= count; i += 8) add(a + i, b + i, c + i, whole);
    if (i < count) add(a + i, b + i, c + i, rest);
    *sums = sumOf(whole, rest);
  }
};

}  // namespace sdvo
