#pragma once

#include <cstdint>
#include <cstring>

#include "kernel.hpp"

namespace sdvo {

/// Floats in a register, for kernels that work on each of them alone.
#ifdef SDVO_HAVE_AVX2
constexpr int kRegister = 8;
#else
constexpr int kRegister = 4;
#endif
typedef float Register __attribute__((vector_size(4 * kRegister)));
typedef std::int32_t IntRegister __attribute__((vector_size(4 * kRegister)));
/// Sums in these wrap around.
typedef std::uint32_t UnsignedRegister __attribute__((vector_size(4 * kRegister)));

// A shuffle makes a register of the lanes of two, a and b. Lanes are numbered through a, then b: with AVX2 0 to 7 and 8
// to 15, else 0 to 3 and 4 to 7. AVX2 shuffles by one instruction if lanes stay in their half of a register. Hence each
// half gets two even (or odd) lanes of a, then two of b, and readPairs() fills registers to match.
#ifdef __clang__
#define SDVO_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define SDVO_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, IntRegister{__VA_ARGS__})
#endif
#ifdef SDVO_HAVE_AVX2
#define SDVO_EVENS 0, 2, 8, 10, 4, 6, 12, 14
#define SDVO_ODDS 1, 3, 9, 11, 5, 7, 13, 15
#define SDVO_NEXT 1, 2, 3, 4, 5, 6, 7, 8
#else
#define SDVO_EVENS 0, 2, 4, 6
#define SDVO_ODDS 1, 3, 5, 7
#define SDVO_NEXT 1, 2, 3, 4
#endif

/// The right neighbours of the lanes of `here`; that of the last one is the first of `behind`.
SDVO_IN_KERNEL Register nextOf(Register here, Register behind) {
  return SDVO_SHUFFLE(here, behind, SDVO_NEXT);
}

SDVO_IN_KERNEL Register toFloats(UnsignedRegister numbers) {
  return __builtin_convertvector(reinterpret_cast<IntRegister>(numbers), Register);
}

/// Values without their fractions, clamped to [0, last].
SDVO_IN_KERNEL IntRegister truncated(Register values, IntRegister last) {
  const IntRegister zero{}, whole = __builtin_convertvector(values, IntRegister);
  const IntRegister not_above = whole < last ? whole : last;
  return not_above > zero ? not_above : zero;
}

template <class Bits, class Number>
SDVO_IN_KERNEL Bits bitsAt(const Number* place) {
  Bits bits;
  std::memcpy(&bits, place, sizeof bits);
  return bits;
}

// Reads from scattered places. Single ones are faster than AVX2's gather instruction. Places are unsigned, which spares
// an instruction for each address.

/// Pairs numbers[p], numbers[p + 1] for the places 0 and 1; in a register of eight also for the places 4 and 5. Those
/// for the other places are read with `places + 2`.
SDVO_IN_KERNEL UnsignedRegister readPairs(const std::int32_t* numbers, const std::uint32_t* places) {
  typedef std::int64_t PairRegister __attribute__((vector_size(4 * kRegister)));
  const auto at = [&](int k) { return bitsAt<std::int64_t>(numbers + places[k]); };
#ifdef SDVO_HAVE_AVX2
  return reinterpret_cast<UnsignedRegister>(PairRegister{at(0), at(1), at(4), at(5)});
#else
  return reinterpret_cast<UnsignedRegister>(PairRegister{at(0), at(1)});
#endif
}

/// For each place, the four bytes that begin there, as one number.
SDVO_IN_KERNEL UnsignedRegister readFours(const std::uint8_t* bytes, const std::uint32_t* places) {
  const auto at = [&](int k) { return bitsAt<std::uint32_t>(bytes + places[k]); };
#ifdef SDVO_HAVE_AVX2
  return UnsignedRegister{at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)};
#else
  return UnsignedRegister{at(0), at(1), at(2), at(3)};
#endif
}

/// For each place, in order, a number and its right neighbour in memory: first() and second().
class Pairs {
 public:
  /// Two results of readPairs(): of places from 0 on, and from 2 on.
  SDVO_IN_KERNEL Pairs(UnsignedRegister low, UnsignedRegister high)
      : low_(reinterpret_cast<Register>(low)), high_(reinterpret_cast<Register>(high)) {}

  SDVO_IN_KERNEL UnsignedRegister first() const {
    return reinterpret_cast<UnsignedRegister>(SDVO_SHUFFLE(low_, high_, SDVO_EVENS));
  }
  SDVO_IN_KERNEL UnsignedRegister second() const {
    return reinterpret_cast<UnsignedRegister>(SDVO_SHUFFLE(low_, high_, SDVO_ODDS));
  }

 private:
  Register low_, high_;  ///< bits of integers, typed as floats: AVX2's shuffle of two registers takes only floats
};

}  // namespace sdvo
