#include "freak.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/core/utility.hpp>

#include "../common/registers.hpp"

namespace sdvo {
namespace {

constexpr std::array<Freak::FieldPair, Freak::kBits> kLearntPairs = {{
#include "freak_pairs.inc"
}};

/// Rings from the outside in; radius and sigma in units of the pattern's reach (Alahi et al. 2012, section 4.1).
std::array<Freak::Field, Freak::kFields> makePattern() {
  constexpr int kRings = 8;
  constexpr int kFieldsOfRing[kRings] = {6, 6, 6, 6, 6, 6, 6, 1};
  constexpr double kOuter = 2.0 / 3.0, kInner = 2.0 / 24.0, kUnit = (kOuter - kInner) / 21.0;
  constexpr double kRingRadii[kRings] = {kOuter,
                                         kOuter - 6 * kUnit,
                                         kOuter - 11 * kUnit,
                                         kOuter - 15 * kUnit,
                                         kOuter - 18 * kUnit,
                                         kOuter - 20 * kUnit,
                                         kInner,
                                         0.0};
  std::array<Freak::Field, Freak::kFields> fields{};
  std::size_t next = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double sigma = kRingRadii[std::min(ring, kRings - 2)] / 2.0;
    for (int k = 0; k < kFieldsOfRing[ring]; ++k) {
      // Every second ring is turned by half a step, so that the fields interlace.
      const double alpha = CV_2PI * k / kFieldsOfRing[ring] + (ring % 2) * CV_PI / 6.0;
      fields[next++] = {static_cast<float>(kRingRadii[ring] * std::cos(alpha)),
                        static_cast<float>(kRingRadii[ring] * std::sin(alpha)), static_cast<float>(sigma)};
    }
  }
  return fields;
}

/// The three diameters of each of the five outer rings of six fields that pass through the centre, and the sides of the
/// triangles on it: 45 pairs symmetric about the centre.
std::vector<Freak::FieldPair> makeOrientationPairs() {
  std::vector<Freak::FieldPair> pairs;
  const auto add = [&](int a, int b) {
    pairs.emplace_back(static_cast<std::uint8_t>(a), static_cast<std::uint8_t>(b));
  };
  for (int ring = 0; ring < 5; ++ring) {
    const int first = 6 * ring;
    for (int k = 0; k < 3; ++k) add(first + k, first + k + 3);
    for (int k = 0; k < 6; ++k) add(first + k, first + (k + 2) % 6);
  }
  return pairs;
}

/// Scale and rotation of the pattern at a key point.
struct FreakPose {
  static constexpr float kSmallestHalfSide = 0.5f;  ///< of a field's box: one pixel

  explicit FreakPose(const ViewKeypoint& keypoint)
      : scale(static_cast<float>(Freak::reach(keypoint.size))),
        cosine(keypoint.angle < 0.f ? scale : std::cos(keypoint.angle) * scale),
        sine(keypoint.angle < 0.f ? 0.f : std::sin(keypoint.angle) * scale) {}

  float scale;         ///< px
  float cosine, sine;  ///< of the angle, times the scale
};

/// Key points that are described at once.
constexpr int kOctet = 8;

/// Mean intensities of each receptive field for each of the eight.
using OctetMeans = std::array<std::array<float, kOctet>, Freak::kFields>;

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

const std::array<Freak::Field, Freak::kFields>& Freak::pattern() {
  static const std::array<Field, kFields> fields = makePattern();
  return fields;
}

const std::array<Freak::FieldPair, Freak::kBits>& Freak::pairs() {
  return kLearntPairs;
}

bool Freak::fits(const ViewKeypoint& keypoint, cv::Size image_size) {
  return keypoint.size > 0.f && liesInside(keypoint.u, keypoint.v, reach(keypoint.size), image_size);
}

Freak::Freak(const cv::Mat& image) : image_(image) {}

std::array<float, Freak::kFields> Freak::intensities(const ViewKeypoint& keypoint) const {
  const auto [scale, cosine, sine] = FreakPose(keypoint);
  std::array<float, kFields> means;
  for (int i = 0; i < kFields; ++i) {
    const Field& field = pattern()[i];
    const float x = keypoint.u + cosine * field.x - sine * field.y;
    const float y = keypoint.v + sine * field.x + cosine * field.y;
    const float half = std::max(field.sigma * scale, FreakPose::kSmallestHalfSide);
    means[i] = image_.boxMean(x, y, half);
  }
  return means;
}

void Freak::describe(const std::vector<ViewKeypoint>& keypoints, const std::vector<std::uint8_t*>& rows) const {
  const int count = static_cast<int>(keypoints.size());
  cv::parallel_for_(cv::Range(0, (count + kOctet - 1) / kOctet), [&](const cv::Range& range) {
    std::array<ViewKeypoint, kOctet> of_octet;
    std::array<std::uint8_t*, kOctet> to;
    OctetMeans means;
    for (int octet = range.start; octet < range.end; ++octet) {
      for (int k = 0; k < kOctet; ++k) {
        const int i = std::min(octet * kOctet + k, count - 1);  // the last one fills its octet up
        of_octet[k] = keypoints[i], to[k] = rows[i];
      }
      runKernel<MeasureFields>(&image_.sums(), of_octet.data(), &means);
      runKernel<CompareMeans>(&means, to.data());
    }
  });
}

float Freak::orientation(ViewKeypoint keypoint) const {
  static const std::vector<FieldPair> orientation_pairs = makeOrientationPairs();
  keypoint.angle = -1.f;
  const std::array<float, kFields> means = intensities(keypoint);
  double gx = 0.0, gy = 0.0;
  for (const auto& [a, b] : orientation_pairs) {
    const double dx = pattern()[a].x - pattern()[b].x, dy = pattern()[a].y - pattern()[b].y;
    const double weight = (means[a] - means[b]) / std::hypot(dx, dy);
    gx += weight * dx;
    gy += weight * dy;
  }
  const double angle = std::atan2(gy, gx);
  return static_cast<float>(angle < 0.0 ? angle + CV_2PI : angle);
}

}  // namespace sdvo
