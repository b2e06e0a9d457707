#include "freak_octet.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "../common/lanes.hpp"

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
/// IntegralImage::boxMean with the same operations in the same order, four boxes at once.
class FourBoxes {
 public:
  SDVO_AVX2 explicit FourBoxes(const cv::Mat& integral)
      : sums_(integral.ptr<std::int32_t>()),
        step_(_mm_set1_epi32(static_cast<int>(integral.step1()))),
        last_column_(_mm_set1_epi32(integral.cols - 2)),
        last_row_(_mm_set1_epi32(integral.rows - 2)) {}

  SDVO_AVX2 __m128 means(__m256d u, __m256d v, __m256d half) const {
    const Edge left = edge(_mm256_sub_pd(u, half), last_column_), right = edge(_mm256_add_pd(u, half), last_column_);
    const Edge top = edge(_mm256_sub_pd(v, half), last_row_), bottom = edge(_mm256_add_pd(v, half), last_row_);
    const __m256d sum = _mm256_sub_pd(across(left, right, bottom), across(left, right, top));
    const __m256d area = _mm256_mul_pd(_mm256_mul_pd(_mm256_set1_pd(4.0), half), half);
    return _mm256_cvtpd_ps(_mm256_div_pd(sum, area));
  }

 private:
  struct Edge {
    __m128i index;
    __m256d share;
  };

  SDVO_AVX2 static Edge edge(__m256d position, __m128i last) {
    const __m256d shifted = _mm256_add_pd(position, _mm256_set1_pd(0.5));
    const __m128i index = _mm_max_epi32(_mm_min_epi32(_mm256_cvttpd_epi32(shifted), last), _mm_setzero_si128());
    return {index, _mm256_sub_pd(shifted, _mm256_cvtepi32_pd(index))};
  }

  SDVO_AVX2 static __m256d interpolated(__m256d a, __m256d b, __m256d share) {
    return _mm256_add_pd(a, _mm256_mul_pd(share, _mm256_sub_pd(b, a)));
  }

  /// The integral at a place of a row: two neighbours come with one read.
  SDVO_AVX2 __m256d at(__m128i row, const Edge& column) const {
    const __m256i pairs = _mm256_i32gather_epi64(reinterpret_cast<const long long*>(sums_),
                                                 _mm_add_epi32(row, column.index), sizeof(std::int32_t));
    const __m256i firsts_then_seconds = _mm256_permutevar8x32_epi32(pairs, _mm256_setr_epi32(0, 2, 4, 6, 1, 3, 5, 7));
    return interpolated(_mm256_cvtepi32_pd(_mm256_castsi256_si128(firsts_then_seconds)),
                        _mm256_cvtepi32_pd(_mm256_extracti128_si256(firsts_then_seconds, 1)), column.share);
  }

  /// Sum of all above an edge, between the left and the right one.
  SDVO_AVX2 __m256d across(const Edge& left, const Edge& right, const Edge& edge) const {
    const __m128i upper = _mm_mullo_epi32(edge.index, step_), lower = _mm_add_epi32(upper, step_);
    return interpolated(_mm256_sub_pd(at(upper, right), at(upper, left)),
                        _mm256_sub_pd(at(lower, right), at(lower, left)), edge.share);
  }

  const std::int32_t* sums_;
  __m128i step_, last_column_, last_row_;
};

SDVO_AVX2 void measureWithAvx2(const cv::Mat& integral, const FreakKeypoint* keypoints, OctetMeans& means) {
  const FourBoxes boxes(integral);
  const auto& pattern = Freak::pattern();
  for (std::size_t first = 0; first < kOctet; first += 4) {
    alignas(32) double us[4], vs[4], scales[4], cosines[4], sines[4];
    for (std::size_t k = 0; k < 4; ++k) {
      const FreakKeypoint& keypoint = keypoints[first + k];
      us[k] = keypoint.u, vs[k] = keypoint.v;
      const FreakPose pose(keypoint);
      scales[k] = pose.scale, cosines[k] = pose.cosine, sines[k] = pose.sine;
    }
    const __m256d u = _mm256_load_pd(us), v = _mm256_load_pd(vs), scale = _mm256_load_pd(scales);
    const __m256d cosine = _mm256_load_pd(cosines), sine = _mm256_load_pd(sines);
    for (std::size_t i = 0; i < Freak::kFields; ++i) {
      const Freak::Field& field = pattern[i];
      const __m256d fx = _mm256_set1_pd(field.x), fy = _mm256_set1_pd(field.y);
      const __m256d x = _mm256_sub_pd(_mm256_add_pd(u, _mm256_mul_pd(cosine, fx)), _mm256_mul_pd(sine, fy));
      const __m256d y = _mm256_add_pd(_mm256_add_pd(v, _mm256_mul_pd(sine, fx)), _mm256_mul_pd(cosine, fy));
      const __m256d half = _mm256_max_pd(_mm256_mul_pd(_mm256_set1_pd(field.sigma), scale),
                                         _mm256_set1_pd(FreakPose::kSmallestHalfSide));
      _mm_storeu_ps(&means[i][first], boxes.means(x, y, half));
    }
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
  const cv::Mat& integral = freak.integral();
  if (usesAvx2() && integral.depth() == CV_32S) return measureWithAvx2(integral, keypoints, means);
#endif
  measurePlain(freak, keypoints, means);
}

void compareOctet(const OctetMeans& means, std::uint8_t* const* rows) {
#ifdef SDVO_HAVE_AVX2
  if (usesAvx2()) return compareWithAvx2(means, rows);
#endif
  comparePlain(means, rows);
}

}  // namespace sdvo
