#include "freak_octet.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "../common/kernel.hpp"
#include "freak_octet_neon.hpp"

#ifdef SDVO_HAVE_AVX2
#include <immintrin.h>
#endif

namespace sdvo {
namespace {

void measurePlain(const Freak& freak, const FreakKeypoint* keypoints, OctetMeans& means) {
  for (std::size_t k = 0; k < kOctet; ++k) {
    const std::array<float, Freak::kFields> of_one = freak.intensities(keypoints[k]);
    for (std::size_t field = 0; field < Freak::kFields; ++field) means[field][k] = of_one[field];
  }
}

#ifdef SDVO_HAVE_AVX2
/// IntegralImage::boxMean with the same operations in the same order, eight boxes at once.
class EightBoxes {
 public:
  SDVO_AVX2 explicit EightBoxes(const cv::Mat& sums)
      : sums_(sums.ptr<std::int32_t>()),
        step_(static_cast<std::ptrdiff_t>(sums.step1())),
        steps_(_mm256_set1_epi32(static_cast<int>(step_))),
        last_column_(_mm256_set1_epi32(sums.cols - 2)),
        last_row_(_mm256_set1_epi32(sums.rows - 2)) {}

  SDVO_AVX2 __m256 means(__m256 u, __m256 v, __m256 half) const {
    const Edge left = edge(_mm256_sub_ps(u, half), last_column_), right = edge(_mm256_add_ps(u, half), last_column_);
    const Edge top = edge(_mm256_sub_ps(v, half), last_row_), bottom = edge(_mm256_add_ps(v, half), last_row_);
    const Places above(top, left, right, steps_), below(bottom, left, right, steps_);
    // Each register has what two boxes need of two rows: first the columns at the left edge, then those at the right
    // one.
    __m256i inside[4], at_top[4], at_bottom[4];
    for (int k = 0; k < 4; ++k) {
      const __m256i first = above.read(sums_, k), last = below.read(sums_, k);
      inside[k] = _mm256_sub_epi32(last, first);
      at_top[k] = _mm256_sub_epi32(above.read(sums_ + step_, k), first);
      at_bottom[k] = _mm256_sub_epi32(below.read(sums_ + step_, k), last);
    }
    const __m256 down_to_bottom =
        _mm256_add_ps(between(inside, left, right), _mm256_mul_ps(bottom.share, between(at_bottom, left, right)));
    const __m256 sum = _mm256_sub_ps(down_to_bottom, _mm256_mul_ps(top.share, between(at_top, left, right)));
    const __m256 area = _mm256_mul_ps(width(left, right), width(top, bottom));
    const __m256 rounding = _mm256_set1_ps(IntegralImage::kRounding);
    return _mm256_sub_ps(_mm256_add_ps(_mm256_div_ps(sum, area), rounding), rounding);
  }

 private:
  struct Edge {
    __m256i index;
    __m256 share;
  };

  SDVO_AVX2 static Edge edge(__m256 position, __m256i last) {
    const __m256 shifted = _mm256_add_ps(position, _mm256_set1_ps(0.5f));
    const __m256i index =
        _mm256_max_epi32(_mm256_min_epi32(_mm256_cvttps_epi32(shifted), last), _mm256_setzero_si256());
    return {index, _mm256_sub_ps(shifted, _mm256_cvtepi32_ps(index))};
  }

  SDVO_AVX2 static __m256 width(const Edge& first, const Edge& last) {
    return _mm256_add_ps(_mm256_cvtepi32_ps(_mm256_sub_epi32(last.index, first.index)),
                         _mm256_sub_ps(last.share, first.share));
  }

  /// Where the left and the right edge of eight boxes meet a row.
  class Places {
   public:
    SDVO_AVX2 Places(const Edge& row, const Edge& left, const Edge& right, __m256i steps) {
      const __m256i begin = _mm256_mullo_epi32(row.index, steps);
      _mm256_store_si256(reinterpret_cast<__m256i*>(left_), _mm256_add_epi32(begin, left.index));
      _mm256_store_si256(reinterpret_cast<__m256i*>(right_), _mm256_add_epi32(begin, right.index));
    }

    /// For the boxes k and k + 4 two neighbours at the left edge and two at the right one. Four reads of two numbers
    /// are faster than gathering.
    SDVO_AVX2 __m256i read(const std::int32_t* sums, int k) const {
      return _mm256_inserti128_si256(_mm256_castsi128_si256(readOne(sums, k)), readOne(sums, k + 4), 1);
    }

   private:
    SDVO_AVX2 __m128i readOne(const std::int32_t* sums, int k) const {
      const __m128i at_left = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(sums + left_[k]));
      const auto* at_right = reinterpret_cast<const double*>(sums + right_[k]);
      return _mm_castpd_si128(_mm_loadh_pd(_mm_castsi128_pd(at_left), at_right));
    }

    alignas(32) std::int32_t left_[kOctet], right_[kOctet];
  };

  /// IntegralImage::sumBetween of eight boxes.
  SDVO_AVX2 static __m256 between(const __m256i (&rows)[4], const Edge& left, const Edge& right) {
    const __m256i lefts[] = {_mm256_unpacklo_epi32(rows[0], rows[1]), _mm256_unpacklo_epi32(rows[2], rows[3])};
    const __m256i rights[] = {_mm256_unpackhi_epi32(rows[0], rows[1]), _mm256_unpackhi_epi32(rows[2], rows[3])};
    const __m256i at_left = _mm256_unpacklo_epi64(lefts[0], lefts[1]);
    const __m256i behind_left = _mm256_unpackhi_epi64(lefts[0], lefts[1]);
    const __m256i at_right = _mm256_unpacklo_epi64(rights[0], rights[1]);
    const __m256i behind_right = _mm256_unpackhi_epi64(rights[0], rights[1]);
    const __m256 whole = _mm256_cvtepi32_ps(_mm256_sub_epi32(at_right, at_left));
    const __m256 of_right = _mm256_cvtepi32_ps(_mm256_sub_epi32(behind_right, at_right));
    const __m256 of_left = _mm256_cvtepi32_ps(_mm256_sub_epi32(behind_left, at_left));
    return _mm256_sub_ps(_mm256_add_ps(whole, _mm256_mul_ps(right.share, of_right)),
                         _mm256_mul_ps(left.share, of_left));
  }

  const std::int32_t* sums_;
  std::ptrdiff_t step_;
  __m256i steps_, last_column_, last_row_;
};

SDVO_AVX2 void measureWithAvx2(const cv::Mat& sums, const FreakKeypoint* keypoints, OctetMeans& means) {
  const EightBoxes boxes(sums);
  alignas(32) float us[kOctet], vs[kOctet], scales[kOctet], cosines[kOctet], sines[kOctet];
  for (int k = 0; k < kOctet; ++k) {
    us[k] = keypoints[k].u, vs[k] = keypoints[k].v;
    const FreakPose pose(keypoints[k]);
    scales[k] = pose.scale, cosines[k] = pose.cosine, sines[k] = pose.sine;
  }
  const __m256 u = _mm256_load_ps(us), v = _mm256_load_ps(vs), scale = _mm256_load_ps(scales);
  const __m256 cosine = _mm256_load_ps(cosines), sine = _mm256_load_ps(sines);
  const auto& pattern = Freak::pattern();
  for (std::size_t i = 0; i < Freak::kFields; ++i) {
    const Freak::Field& field = pattern[i];
    const __m256 fx = _mm256_set1_ps(field.x), fy = _mm256_set1_ps(field.y);
    const __m256 x = _mm256_sub_ps(_mm256_add_ps(u, _mm256_mul_ps(cosine, fx)), _mm256_mul_ps(sine, fy));
    const __m256 y = _mm256_add_ps(_mm256_add_ps(v, _mm256_mul_ps(sine, fx)), _mm256_mul_ps(cosine, fy));
    const __m256 half =
        _mm256_max_ps(_mm256_mul_ps(_mm256_set1_ps(field.sigma), scale), _mm256_set1_ps(FreakPose::kSmallestHalfSide));
    _mm256_storeu_ps(means[i].data(), boxes.means(x, y, half));
  }
}
#endif

void comparePlain(const OctetMeans& means, std::uint8_t* const* rows) {
  typedef std::int32_t LaneBits __attribute__((vector_size(sizeof(Lanes))));
  for (int byte = 0; byte < Freak::kBytes; ++byte) {
    LaneBits bits{};
    for (int bit = 0; bit < 8; ++bit) {
      const Freak::FieldPair& pair = Freak::pairs()[static_cast<std::size_t>(8 * byte + bit)];
      Lanes a, b;
      load(means[pair.first].data(), a), load(means[pair.second].data(), b);
      bits |= (a > b) & (1 << bit);
    }
    for (int k = 0; k < kOctet; ++k) rows[k][byte] = static_cast<std::uint8_t>(bits[k]);
  }
}

#ifdef SDVO_HAVE_AVX2
/// First one bit of all eight rows with each comparison, then 32 bits of one row with each mask.
SDVO_AVX2 void compareWithAvx2(const OctetMeans& means, std::uint8_t* const* rows) {
  const auto& pairs = Freak::pairs();
  alignas(32) std::uint8_t bit_of_rows[Freak::kBits];
#pragma GCC unroll 8
  for (std::size_t bit = 0; bit < Freak::kBits; ++bit) {
    const __m256 a = _mm256_loadu_ps(means[pairs[bit].first].data());
    const __m256 b = _mm256_loadu_ps(means[pairs[bit].second].data());
    bit_of_rows[bit] = static_cast<std::uint8_t>(_mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_GT_OQ)));
  }
  for (int first = 0; first < Freak::kBits; first += 32) {
    __m256i bits = _mm256_load_si256(reinterpret_cast<const __m256i*>(bit_of_rows + first));
    for (int k = kOctet - 1; k >= 0; --k) {
      const int of_row = _mm256_movemask_epi8(bits);  // each byte's highest bit
      std::memcpy(rows[k] + first / 8, &of_row, sizeof of_row);
      bits = _mm256_add_epi8(bits, bits);
    }
  }
}
#endif

}  // namespace

void measureOctet(const Freak& freak, const FreakKeypoint* keypoints, OctetMeans& means) {
#ifdef SDVO_HAVE_AVX2
  if (usesVectorKernels()) return measureWithAvx2(freak.image().sums(), keypoints, means);
#elif defined(SDVO_HAVE_NEON)
  if (usesVectorKernels()) return measureWithNeon(freak.image().sums(), keypoints, means);
#endif
  measurePlain(freak, keypoints, means);
}

void compareOctet(const OctetMeans& means, std::uint8_t* const* rows) {
#ifdef SDVO_HAVE_AVX2
  if (usesVectorKernels()) return compareWithAvx2(means, rows);
#elif defined(SDVO_HAVE_NEON)
  if (usesVectorKernels()) return compareWithNeon(means, rows);
#endif
  comparePlain(means, rows);
}

}  // namespace sdvo
