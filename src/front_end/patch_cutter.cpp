#include "stereo_descriptor_vo/front_end/patch_cutter.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "../common/kernel.hpp"
#include "patch_cutter_neon.hpp"
#include "patch_edges.hpp"

#ifdef SDVO_HAVE_AVX2
#include <immintrin.h>
#endif

namespace sdvo {
namespace {

/// `size`: columns or rows of the integral. Pixel p covers [p - 0.5, p + 0.5], and column p of the integral is its left
/// edge.
struct FindEdges {
  static SDVO_IN_KERNEL void run(float centre, int side, float spacing, int size, PatchEdges* edges) {
    const float middle = centre + 0.5f, last = static_cast<float>(size) - 1.001f;
    for (int k = 0; k < kMostEdges; ++k) {
      const float offset = (static_cast<float>(k) - 0.5f * static_cast<float>(side)) * spacing;
      const float position = std::clamp(middle + offset, 0.f, last);
      edges->index[k] = static_cast<int>(position);
      edges->share[k] = position - static_cast<float>(edges->index[k]);
    }
    edges->width[kMostEdges - 1] = 0.f;
    for (int k = 0; k < kMostEdges - 1; ++k)
      edges->width[k] =
          static_cast<float>(edges->index[k + 1] - edges->index[k]) + edges->share[k + 1] - edges->share[k];
  }
};

PatchEdges edgesAround(float centre, int side, float spacing, int size) {
  PatchEdges edges;
  runKernel<FindEdges>(centre, side, spacing, size, &edges);
  return edges;
}

/// The integral at the columns' edges, between rows of it. It counts from the patch's own corner: such sums are small
/// enough to be exact in single precision.
class Sums {
 public:
  Sums(const cv::Mat& integral, const PatchEdges& columns, const PatchEdges& rows)
      : integral_(integral), columns_(columns), origin_(integral.ptr<int>(rows.index[0])[columns.index[0]]) {}

  float at(int row, float share, int edge) const {
    const float upper = inRow(row, edge), lower = inRow(row + 1, edge);
    return upper + share * (lower - upper);
  }

 private:
  float inRow(int row, int edge) const {
    const int* sums = integral_.ptr<int>(row) + columns_.index[edge];
    const float first = sinceOrigin(sums[0]), second = sinceOrigin(sums[1]);
    return first + columns_.share[edge] * (second - first);
  }
  float sinceOrigin(int sum) const {
    return static_cast<float>(static_cast<int>(static_cast<unsigned>(sum) - static_cast<unsigned>(origin_)));
  }

  const cv::Mat& integral_;
  const PatchEdges& columns_;
  int origin_;
};

void cutPlain(const cv::Mat& integral, const PatchEdges& columns, const PatchEdges& rows, int side,
              std::uint8_t* samples) {
  const Sums sums(integral, columns, rows);
  PerEdge above{};  // all that lies above a row of squares, for each of its columns
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i < side; ++i) {
      const float upto = sums.at(rows.index[j], rows.share[j], i + 1) - sums.at(rows.index[j], rows.share[j], i);
      const float inside = upto - above[i];
      above[i] = upto;
      if (j == 0) continue;
      const float area = columns.width[i] * rows.width[j - 1];
      *samples++ = cv::saturate_cast<std::uint8_t>(area > 0.f ? inside / area : 0.f);
    }
}

#ifdef SDVO_HAVE_AVX2
/// Sums in a row at the edges, eight of them at once, with the operations of the plain form.
class EightSums {
 public:
  /// `registers`: how many hold the edges.
  SDVO_AVX2 EightSums(const PatchEdges& columns, int registers, int origin)
      : columns_(columns),
        neighbours_(areNeighbours(columns.index.data(), 8 * registers)),
        origin_(_mm256_set1_epi32(origin)) {}

  SDVO_AVX2 __m256 inRow(const int* row, int r) const {
    if (neighbours_) {  // as most are: edges a pixel apart
      const int* begin = row + columns_.index[8 * r];
      return between(load(begin), load(begin + 1), r);
    }
    // As 0, 1, 4, 5, 2, 3, 6, 7, so that the shuffles leave them in order. Two neighbours come with one read.
    const __m256i turned = _mm256_permute4x64_epi64(load(&columns_.index[8 * r]), 0xd8);
    const auto* pairs = reinterpret_cast<const long long*>(row);
    const __m256i low = _mm256_i32gather_epi64(pairs, _mm256_castsi256_si128(turned), sizeof(int));
    const __m256i high = _mm256_i32gather_epi64(pairs, _mm256_extracti128_si256(turned, 1), sizeof(int));
    return between(shuffled<0x88>(low, high), shuffled<0xdd>(low, high), r);
  }

 private:
  template <int kChoice>
  SDVO_AVX2 static __m256i shuffled(__m256i a, __m256i b) {
    return _mm256_castps_si256(_mm256_shuffle_ps(_mm256_castsi256_ps(a), _mm256_castsi256_ps(b), kChoice));
  }
  SDVO_AVX2 static bool areNeighbours(const int* index, int count) {
    bool all = true;
    for (int k = 1; k < count; ++k) all &= index[k] == index[0] + k;
    return all;
  }
  SDVO_AVX2 static __m256i load(const int* values) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(values));
  }
  SDVO_AVX2 __m256 sinceOrigin(__m256i sums) const { return _mm256_cvtepi32_ps(_mm256_sub_epi32(sums, origin_)); }
  SDVO_AVX2 __m256 between(__m256i sums, __m256i next_sums, int r) const {
    const __m256 first = sinceOrigin(sums), second = sinceOrigin(next_sums);
    const __m256 share = _mm256_loadu_ps(&columns_.share[8 * r]);
    return _mm256_add_ps(first, _mm256_mul_ps(share, _mm256_sub_ps(second, first)));
  }

  const PatchEdges& columns_;
  bool neighbours_;
  __m256i origin_;
};

/// Eight means as bytes, rounded to the nearest whole number, the even one of two.
SDVO_AVX2 inline void storeRounded(__m256 means, std::uint8_t* bytes) {
  const __m256i whole = _mm256_cvtps_epi32(means);
  const __m128i words = _mm_packus_epi32(_mm256_castsi256_si128(whole), _mm256_extracti128_si256(whole, 1));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(bytes), _mm_packus_epi16(words, words));
}

/// What is at the next edge, where `here` holds eight edges and `behind` the eight after them.
SDVO_AVX2 inline __m256 nextOf(__m256 here, __m256 behind) {
  return _mm256_permutevar8x32_ps(_mm256_blend_ps(here, behind, 1), _mm256_setr_epi32(1, 2, 3, 4, 5, 6, 7, 0));
}

/// The same row by row, eight columns at once. `kRegisters` hold the edges.
template <int kRegisters>
SDVO_AVX2 void cutWithAvx2(const cv::Mat& integral, const PatchEdges& columns, const PatchEdges& rows, int side,
                           std::uint8_t* samples) {
  const EightSums sums(columns, kRegisters, integral.ptr<int>(rows.index[0])[columns.index[0]]);
  const __m256 zero = _mm256_setzero_ps();
  __m256 upper[kRegisters] = {}, lower[kRegisters] = {}, above[kRegisters] = {}, across[kRegisters];
  std::array<std::uint8_t, PatchOptions::kMostSamples * PatchOptions::kMostSamples + 8 * kRegisters> patch;
  for (int j = 0; j <= side; ++j) {
    const int row = rows.index[j];
    // Where edges are a pixel apart, each row of the integral serves two of them.
    const bool known = j > 0 && row == rows.index[j - 1] + 1;
    const __m256 share = _mm256_set1_ps(rows.share[j]), height = _mm256_set1_ps(j > 0 ? rows.width[j - 1] : 0.f);
    for (int r = 0; r < kRegisters; ++r) {
      upper[r] = known ? lower[r] : sums.inRow(integral.ptr<int>(row), r);
      lower[r] = sums.inRow(integral.ptr<int>(row + 1), r);
      across[r] = _mm256_add_ps(upper[r], _mm256_mul_ps(share, _mm256_sub_ps(lower[r], upper[r])));
    }
    for (int r = 0; r < kRegisters; ++r) {
      const __m256 upto = _mm256_sub_ps(nextOf(across[r], across[std::min(r + 1, kRegisters - 1)]), across[r]);
      const __m256 inside = _mm256_sub_ps(upto, above[r]);
      above[r] = upto;
      if (j == 0) continue;
      const __m256 area = _mm256_mul_ps(_mm256_loadu_ps(&columns.width[8 * r]), height);
      const __m256 mean = _mm256_and_ps(_mm256_div_ps(inside, area), _mm256_cmp_ps(area, zero, _CMP_GT_OQ));
      storeRounded(mean, &patch[(j - 1) * side + 8 * r]);
    }
  }
  std::copy_n(patch.begin(), side * side, samples);
}
#endif

}  // namespace

PatchCutter::PatchCutter(const PatchLayout& layout, const cv::Mat& image) : layout_(layout) {
  CV_Assert(image.type() == CV_8UC1);
  cv::integral(image, integral_, CV_32S);
}

void PatchCutter::cut(float u, float v, float size, std::uint8_t* samples) const {
  const float spacing = layout_.spacing(size);
  const PatchEdges columns = edgesAround(u, layout_.side, spacing, integral_.cols);
  const PatchEdges rows = edgesAround(v, layout_.side, spacing, integral_.rows);
#ifdef SDVO_HAVE_AVX2
  if (usesVectorKernels()) {
    const auto cut = layout_.side < 8 ? cutWithAvx2<1> : layout_.side < 16 ? cutWithAvx2<2> : cutWithAvx2<3>;
    return cut(integral_, columns, rows, layout_.side, samples);
  }
#elif defined(SDVO_HAVE_NEON)
  if (usesVectorKernels()) return cutWithNeon(integral_, columns, rows, layout_.side, samples);
#endif
  cutPlain(integral_, columns, rows, layout_.side, samples);
}

}  // namespace sdvo
