#include "freak.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "freak_octet.hpp"
#include "integral_image.hpp"

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
  constexpr double kRadius[kRings] = {kOuter,
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
    const double sigma = kRadius[std::min(ring, kRings - 2)] / 2.0;
    for (int k = 0; k < kFieldsOfRing[ring]; ++k) {
      // Every second ring is turned by half a step, so that the fields interlace.
      const double alpha = CV_2PI * k / kFieldsOfRing[ring] + (ring % 2) * CV_PI / 6.0;
      fields[next++] = {static_cast<float>(kRadius[ring] * std::cos(alpha)),
                        static_cast<float>(kRadius[ring] * std::sin(alpha)), static_cast<float>(sigma)};
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

}  // namespace

const std::array<Freak::Field, Freak::kFields>& Freak::pattern() {
  static const std::array<Field, kFields> fields = makePattern();
  return fields;
}

const std::vector<Freak::FieldPair>& Freak::candidatePairs() {
  static const std::vector<FieldPair> all = [] {
    std::vector<FieldPair> pairs;
    for (int i = 1; i < kFields; ++i)
      for (int j = 0; j < i; ++j) pairs.emplace_back(static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j));
    return pairs;
  }();
  return all;
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

void Freak::describe(const ViewKeypoint& keypoint, std::uint8_t* row) const {
  const std::array<float, kFields> means = intensities(keypoint);
  for (int byte = 0; byte < kBytes; ++byte) {
    unsigned bits = 0;
    for (int bit = 0; bit < 8; ++bit) {
      const FieldPair& pair = kLearntPairs[8 * byte + bit];
      bits |= static_cast<unsigned>(means[pair.first] > means[pair.second]) << bit;
    }
    row[byte] = static_cast<std::uint8_t>(bits);
  }
}

void Freak::describe(const std::vector<ViewKeypoint>& keypoints, const std::vector<std::uint8_t*>& rows) const {
  const std::size_t octets = keypoints.size() / kOctet;
  cv::parallel_for_(cv::Range(0, static_cast<int>(octets)), [&](const cv::Range& range) {
    OctetMeans means;
    for (int octet = range.start; octet < range.end; ++octet) {
      const std::size_t first = static_cast<std::size_t>(octet) * kOctet;
      measureOctet(*this, &keypoints[first], means);
      compareOctet(means, &rows[first]);
    }
  });
  for (std::size_t i = octets * kOctet; i < keypoints.size(); ++i) describe(keypoints[i], rows[i]);
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
