#include "base_descriptor.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/features2d.hpp>
#include <stdexcept>
#include <utility>

#include "brief.hpp"
#include "freak.hpp"
#include "integral_image.hpp"
#include "opencv_features.hpp"

#ifdef SDVO_HAVE_XFEATURES2D
#include <opencv2/xfeatures2d.hpp>
#include <opencv2/xfeatures2d/nonfree.hpp>
#endif

namespace sdvo {
namespace {

ViewDescriptors emptyRows(std::size_t count, int bytes) {
  return {cv::Mat(static_cast<int>(count), bytes, CV_8U), std::vector<std::uint8_t>(count, 0)};
}

class FreakDescriptor : public BaseDescriptor {
 public:
  double reach(double size) const override { return Freak::reach(size); }

  ViewDescriptors describe(const cv::Mat& image, const std::vector<ViewKeypoint>& keypoints) const override {
    const Freak freak(image);
    ViewDescriptors described = emptyRows(keypoints.size(), Freak::kBytes);
    std::vector<ViewKeypoint> fitting;
    std::vector<std::uint8_t*> rows;
    fitting.reserve(keypoints.size()), rows.reserve(keypoints.size());
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      if (!Freak::fits(keypoints[i], image.size())) continue;
      fitting.push_back(keypoints[i]);
      rows.push_back(described.rows.ptr(static_cast<int>(i)));
      described.valid[i] = 1;
    }
    freak.describe(fitting, rows);
    return described;
  }
  ElementType elementType() const override { return ElementType::kBits; }
  int bytes() const override { return Freak::kBytes; }
};

class BriefDescriptor : public BaseDescriptor {
 public:
  double reach(double size) const override { return Brief::reach(size); }

  ViewDescriptors describe(const cv::Mat& image, const std::vector<ViewKeypoint>& keypoints) const override {
    const Brief brief(image);
    ViewDescriptors described = emptyRows(keypoints.size(), Brief::kBytes);
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      const ViewKeypoint& k = keypoints[i];
      if (!liesInside(k.u, k.v, Brief::reach(k.size), image.size())) continue;
      brief.describe(k.u, k.v, k.size, described.rows.ptr(static_cast<int>(i)));
      described.valid[i] = 1;
    }
    return described;
  }
  ElementType elementType() const override { return ElementType::kBits; }
  int bytes() const override { return Brief::kBytes; }
};

/// A descriptor of OpenCV's. Each reads the neighbourhood's size from another field of the key point (size, octave,
/// level): `impose` sets it. Some drop and reorder key points: class_id has the index.
class OpenCvDescriptor : public BaseDescriptor {
 public:
  using Impose = std::function<void(float size, cv::KeyPoint&)>;

  OpenCvDescriptor(cv::Ptr<cv::Feature2D> feature, double reach_per_size, Impose impose)
      : feature_(std::move(feature)), reach_per_size_(reach_per_size), impose_(std::move(impose)) {}

  double reach(double size) const override { return reach_per_size_ * size; }

  ViewDescriptors describe(const cv::Mat& image, const std::vector<ViewKeypoint>& keypoints) const override {
    ViewDescriptors described = emptyRows(keypoints.size(), bytes());
    std::vector<cv::KeyPoint> cv_keypoints;
    std::vector<std::size_t> index_of;
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      const ViewKeypoint& k = keypoints[i];
      if (!liesInside(k.u, k.v, reach(k.size), image.size())) continue;
      const float degrees = k.angle < 0.f ? 0.f : k.angle * static_cast<float>(180.0 / CV_PI);
      cv::KeyPoint keypoint(k.u, k.v, k.size, degrees, 0.f, 0, static_cast<int>(index_of.size()));
      impose_(k.size, keypoint);
      cv_keypoints.push_back(keypoint);
      index_of.push_back(i);
    }
    if (cv_keypoints.empty()) return described;

    cv::Mat rows;
    feature_->compute(image, cv_keypoints, rows);
    if (rows.type() == CV_32F && elementType() == ElementType::kUint8) rows.convertTo(rows, CV_8U);
    const cv::Mat row_bytes(rows.rows, static_cast<int>(rows.cols * rows.elemSize()), CV_8U, rows.data, rows.step);
    for (std::size_t k = 0; k < cv_keypoints.size(); ++k) {
      const std::size_t i = index_of[static_cast<std::size_t>(cv_keypoints[k].class_id)];
      row_bytes.row(static_cast<int>(k)).copyTo(described.rows.row(static_cast<int>(i)));
      described.valid[i] = 1;
    }
    return described;
  }

  ElementType elementType() const override {
    if (feature_->descriptorType() == CV_8U) return ElementType::kBits;
    // SIFT saturates its floats to whole numbers in 0…255: a byte each loses nothing.
    return feature_->defaultNorm() == cv::NORM_L2 && feature_->descriptorSize() == 128 ? ElementType::kUint8
                                                                                       : ElementType::kFloat32;
  }
  int bytes() const override {
    const int element = elementType() == ElementType::kFloat32 ? 4 : 1;
    return feature_->descriptorSize() * element;
  }

 private:
  cv::Ptr<cv::Feature2D> feature_;
  double reach_per_size_;  ///< half of the pattern that OpenCV samples around a key point, in its sizes
  Impose impose_;
};

[[noreturn]] void refuse(DescriptorType type, const std::string& who_has_it) {
  throw std::invalid_argument("type '" + nameOf(type) + "' is not in this OpenCV (" CV_VERSION "): " + who_has_it);
}

#if SDVO_HAVE_SIFT
/// OpenCV's SIFT samples the pyramid image named in the packed `octave` (octave in bits 0…7, layer in bits 8…15). A key
/// point of diameter s has the blur s / 2 = 1.6 * 2^(octave + layer / 3), layer in 1…3 (Lowe 2004, section 3.3).
void imposeSiftLayer(float size, cv::KeyPoint& keypoint) {
  constexpr int kLayers = 3;
  constexpr double kSigma = 1.6;
  const double scale = std::log2(size / 2.0 / kSigma);
  const int step = std::max(static_cast<int>(std::lround(kLayers * scale)), 1 - kLayers);
  const int octave = static_cast<int>(std::floor((step - 1) / static_cast<double>(kLayers)));
  const int layer = step - kLayers * octave;
  keypoint.octave = (octave & 255) | (layer << 8);
}
#endif

std::unique_ptr<BaseDescriptor> makeSift() {
#if SDVO_HAVE_SIFT
  return std::make_unique<OpenCvDescriptor>(cv::SIFT::create(), 3.0, imposeSiftLayer);
#else
  refuse(DescriptorType::kSift, "OpenCV 4.4 and later have it in features2d");
#endif
}

/// ORB reads the pyramid level from `octave`; its 31 px patch belongs to the standard size.
std::unique_ptr<BaseDescriptor> makeOrb() {
  constexpr float kStep = 1.1f, kStandardSize = static_cast<float>(BaseDescriptor::kStandardSize);
  constexpr int kLevels = 24;
  const auto impose = [](float size, cv::KeyPoint& keypoint) {
    const double level = std::log(size / kStandardSize) / std::log(kStep);
    keypoint.octave = std::clamp(static_cast<int>(std::lround(level)), 0, kLevels - 1);
  };
  const auto orb = cv::ORB::create(500, kStep, kLevels, 1, 0, 2, cv::ORB::HARRIS_SCORE, 31, 20);
  return std::make_unique<OpenCvDescriptor>(orb, 19.0 / kStandardSize, impose);
}

std::unique_ptr<BaseDescriptor> makeSurf() {
#ifdef SDVO_HAVE_XFEATURES2D
  try {
    return std::make_unique<OpenCvDescriptor>(cv::xfeatures2d::SURF::create(100, 4, 3, false, true), 10.0 * 1.2 / 9.0,
                                              [](float, cv::KeyPoint&) {});
  } catch (const cv::Exception&) {
    refuse(DescriptorType::kSurf, "its xfeatures2d was built without OPENCV_ENABLE_NONFREE=ON");
  }
#else
  refuse(DescriptorType::kSurf, "builds with opencv_contrib's xfeatures2d and OPENCV_ENABLE_NONFREE=ON have it");
#endif
}

}  // namespace

std::unique_ptr<BaseDescriptor> makeBaseDescriptor(DescriptorType type) {
  switch (type) {
    case DescriptorType::kBrief:
      return std::make_unique<BriefDescriptor>();
    case DescriptorType::kBrisk:
      // It reads the size itself.
      return std::make_unique<OpenCvDescriptor>(cv::BRISK::create(), 2.0, [](float, cv::KeyPoint&) {});
    case DescriptorType::kFreak:
      return std::make_unique<FreakDescriptor>();
    case DescriptorType::kOrb:
      return makeOrb();
    case DescriptorType::kSift:
      return makeSift();
    case DescriptorType::kSurf:
      return makeSurf();
  }
  throw std::invalid_argument("there is no such base descriptor");
}

}  // namespace sdvo
