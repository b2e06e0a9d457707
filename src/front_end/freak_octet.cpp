#include "freak_octet.hpp"

#include <cstddef>

#include "../common/registers.hpp"

namespace sdvo {
namespace {

/// IntegralImage::boxMean with the same operations in the same order, a register of boxes at once.
class Boxes {
 public:
  SDVO_IN_KERNEL explicit Boxes(const cv::Mat& sums)
      : sums_(sums.ptr<std::int32_t>()),
        step_(static_cast<std::int32_t>(sums.step1())),
        last_column_(IntRegister{} + (sums.cols - 2)),
        last_row_(IntRegister{} + (sums.rows - 2)) {}

  SDVO_IN_KERNEL Register means(Register u, Register v, Register half) const {
    const Edge left = edge(u - half, last_column_), right = edge(u + half, last_column_);
    const Edge top = edge(v - half, last_row_), bottom = edge(v + half, last_row_);
    const IntRegister first_row = top.index * step_, last_row = bottom.index * step_;
    const Side at_left = side(left, first_row, last_row), at_right = side(right, first_row, last_row);
    const Register sum = between(at_left.inside, at_right.inside, left, right) +
                         bottom.share * between(at_left.at_bottom, at_right.at_bottom, left, right) -
                         top.share * between(at_left.at_top, at_right.at_top, left, right);
    return sum / (width(left, right) * width(top, bottom)) + IntegralImage::kRounding - IntegralImage::kRounding;
  }

 private:
  struct Edge {
    IntRegister index;
    Register share;
  };

  SDVO_IN_KERNEL static Edge edge(Register position, IntRegister last) {
    const Register shifted = position + 0.5f;
    const IntRegister index = truncated(shifted, last);
    return {index, shifted - __builtin_convertvector(index, Register)};
  }

  SDVO_IN_KERNEL static Register width(const Edge& first, const Edge& last) {
    return __builtin_convertvector(last.index - first.index, Register) + (last.share - first.share);
  }

  /// Differences between rows of the integral, in the two columns around an edge.
  struct Side {
    Pairs inside, at_top, at_bottom;
  };

  SDVO_IN_KERNEL Side side(const Edge& edge, IntRegister first_row, IntRegister last_row) const {
    std::uint32_t above[kRegister], below[kRegister];
    store(first_row + edge.index, above), store(last_row + edge.index, below);
    UnsignedRegister inside[2], at_top[2], at_bottom[2];
    for (int half = 0; half < 2; ++half) {
      const UnsignedRegister first = readPairs(sums_, above + 2 * half), last = readPairs(sums_, below + 2 * half);
      inside[half] = last - first;
      at_top[half] = readPairs(sums_ + step_, above + 2 * half) - first;
      at_bottom[half] = readPairs(sums_ + step_, below + 2 * half) - last;
    }
    return {{inside[0], inside[1]}, {at_top[0], at_top[1]}, {at_bottom[0], at_bottom[1]}};
  }

  /// IntegralImage::sumBetween of boxes.
  SDVO_IN_KERNEL static Register between(const Pairs& at_left, const Pairs& at_right, const Edge& left,
                                         const Edge& right) {
    const UnsignedRegister from = at_left.first(), to = at_right.first();
    return toFloats(to - from) + right.share * toFloats(at_right.second() - to) -
           left.share * toFloats(at_left.second() - from);
  }

  const std::int32_t* sums_;
  std::int32_t step_;
  IntRegister last_column_, last_row_;
};

struct MeasureFields {
  static SDVO_IN_KERNEL void run(const cv::Mat* sums, const ViewKeypoint* keypoints, OctetMeans* means) {
    const Boxes boxes(*sums);
    float us[kOctet], vs[kOctet], scales[kOctet], cosines[kOctet], sines[kOctet];
    for (int k = 0; k < kOctet; ++k) {
      us[k] = keypoints[k].u, vs[k] = keypoints[k].v;
      const FreakPose pose(keypoints[k]);
      scales[k] = pose.scale, cosines[k] = pose.cosine, sines[k] = pose.sine;
    }
    const auto& pattern = Freak::pattern();
    const Register smallest = FreakPose::kSmallestHalfSide - Register{};
    for (int first = 0; first < kOctet; first += kRegister) {
      Register u, v, scale, cosine, sine;
      load(us + first, u), load(vs + first, v), load(scales + first, scale);
      load(cosines + first, cosine), load(sines + first, sine);
      for (std::size_t i = 0; i < Freak::kFields; ++i) {
        const Freak::Field& field = pattern[i];
        const Register x = u + cosine * field.x - sine * field.y, y = v + sine * field.x + cosine * field.y;
        const Register half = field.sigma * scale;
        store(boxes.means(x, y, half < smallest ? smallest : half), (*means)[i].data() + first);
      }
    }
  }
};

/// 32 bits of some rows at once.
struct CompareMeans {
  static SDVO_IN_KERNEL void run(const OctetMeans* means, std::uint8_t* const* rows) {
    for (int first = 0; first < kOctet; first += kRegister)
      for (int byte = 0; byte < Freak::kBytes; byte += 4) {
        const Freak::FieldPair* pairs = &Freak::pairs()[static_cast<std::size_t>(8 * byte)];
        UnsignedRegister bits{}, bit = bits + 1;
#pragma GCC unroll 8
        for (int k = 0; k < 32; ++k, bit += bit) {
          Register a, b;
          load((*means)[pairs[k].first].data() + first, a), load((*means)[pairs[k].second].data() + first, b);
          bits |= reinterpret_cast<UnsignedRegister>(a > b) & bit;
        }
        for (int k = 0; k < kRegister; ++k) {
          std::uint8_t* row = rows[first + k] + byte;
          for (int i = 0; i < 4; ++i) row[i] = static_cast<std::uint8_t>(bits[k] >> 8 * i);
        }
      }
  }
};

}  // namespace

void measureOctet(const Freak& freak, const ViewKeypoint* keypoints, OctetMeans& means) {
  runKernel<MeasureFields>(&freak.image().sums(), keypoints, &means);
}

void compareOctet(const OctetMeans& means, std::uint8_t* const* rows) {
  runKernel<CompareMeans>(&means, rows);
}

}  // namespace sdvo
