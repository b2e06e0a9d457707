#include "depth_scale_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <unsupported/Eigen/LevenbergMarquardt>
#include <unsupported/Eigen/NumericalDiff>

#include "../../src/common/progress.hpp"
#include "../../src/common/statistics.hpp"
#include "correct_matches.hpp"
#include "keypoint_set.hpp"

namespace sdvo {
namespace {

constexpr int kTriedSizes = 31;
constexpr double kSmallestRatio = 0.5, kLargestRatio = 4.0;

double triedRatio(double index) {
  return kSmallestRatio * std::pow(kLargestRatio / kSmallestRatio, index / (kTriedSizes - 1));
}

struct Follower {
  std::size_t first, later;  ///< corners of the two sets
};

/// The later corner next to each first one's reprojection, where there is one and its disparity agrees.
std::vector<Follower> follow(const KeypointSet& first, const std::vector<int>& chosen, const KeypointSet& later,
                             const Eigen::Isometry3d& T_later_first) {
  constexpr double kLargestError = 1.5;             // px
  constexpr double kLargestDisparityChange = 0.08;  // of the predicted disparity
  std::vector<Follower> followers;
  for (const int index : chosen) {
    const auto& [corner, match] = first.corners[static_cast<std::size_t>(index)];
    const Eigen::Vector3d point =
        T_later_first * first.camera.backProject(corner.position.x, corner.position.y, match.disparity);
    if (point.z() < 1.0) continue;
    const Eigen::Vector3d predicted = later.camera.project(point);
    double nearest = kLargestError;
    std::optional<std::size_t> found;
    for (std::size_t k = 0; k < later.corners.size(); ++k) {
      const cv::Point2f& p = later.corners[k].corner.position;
      const double distance = std::hypot(p.x - predicted.x(), p.y - predicted.y());
      if (distance < nearest) nearest = distance, found = k;
    }
    if (!found) continue;
    const double disparity = predicted.x() - predicted.z();
    if (std::abs(later.corners[*found].match.disparity / disparity - 1.0) < kLargestDisparityChange)
      followers.push_back({static_cast<std::size_t>(index), *found});
  }
  return followers;
}

ViewKeypoint leftView(const StereoCorner& corner, double size) {
  return {corner.corner.position.x, corner.corner.position.y, static_cast<float>(size), -1.f};
}

double rowDistance(ElementType type, const cv::Mat& a, const cv::Mat& b) {
  if (type == ElementType::kBits) return cv::norm(a, b, cv::NORM_HAMMING);
  if (type == ElementType::kUint8) return cv::norm(a, b, cv::NORM_L2);
  const cv::Mat float_a(1, a.cols / 4, CV_32F, const_cast<std::uint8_t*>(a.ptr()));
  const cv::Mat float_b(1, b.cols / 4, CV_32F, const_cast<std::uint8_t*>(b.ptr()));
  return cv::norm(float_a, float_b, cv::NORM_L2);
}

/// Ratio at the minimum of the distances, by a parabola through its neighbours in the logarithm; nothing when the
/// minimum lies at an end of the search or the feature is not recognised at any size.
std::optional<double> bestRatio(const std::vector<double>& distances) {
  const auto smallest = std::min_element(distances.begin(), distances.end());
  const std::size_t i = static_cast<std::size_t>(smallest - distances.begin());
  if (i == 0 || i + 1 == distances.size()) return std::nullopt;
  const double worst = *std::max_element(distances.begin(), distances.end());
  constexpr double kRecognised = 0.6;  // of the distance at the worst size
  if (*smallest > kRecognised * worst) return std::nullopt;
  const double before = distances[i - 1], after = distances[i + 1];
  const double curvature = before - 2.0 * *smallest + after;
  const double shift = curvature > 0.0 ? 0.5 * (before - after) / curvature : 0.0;
  return triedRatio(static_cast<double>(i) + shift);
}

double residual(const SizeSample& sample, const ShapeFit& fit) {
  const double now = fit.value(sample.disparity), first = fit.value(sample.first_disparity);
  if (now <= 0.0 || first <= 0.0) return 10.0;  // octaves; no such curve
  return std::log2(sample.ratio) - std::log2(now / first);
}

/// Error of each sample by the free parameters of a curve, bent so that the squares add up to the Cauchy cost.
struct ShapeResiduals : Eigen::DenseFunctor<double> {
  ShapeResiduals(const std::vector<SizeSample>& of, const ShapeFit& start, std::vector<double ShapeFit::*> to_fit)
      : DenseFunctor(static_cast<int>(to_fit.size()), static_cast<int>(of.size())),
        samples(of),
        fixed(start),
        free(std::move(to_fit)) {}

  ShapeFit curve(const Eigen::VectorXd& parameters) const {
    ShapeFit fit = fixed;
    for (std::size_t k = 0; k < free.size(); ++k) fit.*free[k] = parameters[static_cast<Eigen::Index>(k)];
    return fit;
  }

  int operator()(const Eigen::VectorXd& parameters, Eigen::VectorXd& errors) const {
    constexpr double kScale = 0.15;  // octaves at which the kernel bends: the step between tried sizes, doubled
    const ShapeFit fit = curve(parameters);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double r = residual(samples[i], fit) / kScale;
      errors[static_cast<Eigen::Index>(i)] = std::copysign(std::sqrt(std::log1p(r * r)), r);
    }
    return 0;
  }

  const std::vector<SizeSample>& samples;
  ShapeFit fixed;
  std::vector<double ShapeFit::*> free;
};

ShapeFit fitShape(const std::vector<SizeSample>& samples, const std::string& model, bool free_exponent,
                  bool free_offset) {
  ShapeFit start;
  start.model = model;
  std::vector<double ShapeFit::*> free;
  if (free_exponent) free.push_back(&ShapeFit::exponent);
  if (free_offset) free.push_back(&ShapeFit::offset);
  Eigen::NumericalDiff<ShapeResiduals> residuals(ShapeResiduals(samples, start, free));
  Eigen::VectorXd parameters(residuals.inputs()), errors(residuals.values());
  for (std::size_t k = 0; k < free.size(); ++k) parameters[static_cast<Eigen::Index>(k)] = start.*free[k];
  if (!free.empty()) Eigen::LevenbergMarquardt<Eigen::NumericalDiff<ShapeResiduals>>(residuals).minimize(parameters);

  ShapeFit fit = residuals.curve(parameters);
  residuals(parameters, errors);
  fit.robust_cost = errors.squaredNorm() / static_cast<double>(samples.size());
  std::vector<double> sizes;
  for (const SizeSample& sample : samples) sizes.push_back(std::abs(residual(sample, fit)));
  fit.median_residual = median(sizes);
  return fit;
}

}  // namespace

double ShapeFit::value(double disparity) const {
  return std::pow(disparity, exponent) + offset;
}

std::vector<SizeSample> sampleSizes(const ReferenceSequence& sequence, const ExperimentOptions& options,
                                    const SizeSampling& sampling) {
  const FeatureExtractorOptions& extraction = options.stereo_features;
  const auto base = makeBaseDescriptor(extraction.descriptor.type);
  const Reach reach = [&](double size) { return base->reach(size); };
  DepthScaleOptions first_size, largest_size;
  first_size.scale_normalisation = largest_size.scale_normalisation = false;
  first_size.constant_size = sampling.first_size;
  largest_size.constant_size = kLargestRatio * sampling.first_size;

  std::vector<SizeSample> samples;
  Progress progress("sampling " + sequence.name, sequence.frames / sampling.stride + 1);
  for (int t = 0; t + 1 < sequence.frames; t += sampling.stride, progress.step()) {
    const KeypointSet first = findKeypoints(sequence.images, t, options);
    const std::vector<int> chosen =
        selectKeypoints(first, {DepthScale(first_size)}, reach, extraction.detector.bucket_size, sampling.features);
    for (int step = 2; step <= sampling.max_step && t + step < sequence.frames; step += 2) {
      const KeypointSet later = findKeypoints(sequence.images, t + step, options);
      std::vector<ViewKeypoint> first_views;
      const std::vector<Follower> followers = follow(first, chosen, later, sequence.motion(t, t + step));
      for (const Follower& f : followers) first_views.push_back(leftView(first.corners[f.first], sampling.first_size));
      const ViewDescriptors first_rows = base->describe(first.images.left, first_views);

      std::vector<std::vector<double>> distances(followers.size());
      for (int k = 0; k < kTriedSizes; ++k) {
        std::vector<ViewKeypoint> views;
        for (const Follower& f : followers)
          views.push_back(leftView(later.corners[f.later], sampling.first_size * triedRatio(k)));
        const ViewDescriptors rows = base->describe(later.images.left, views);
        for (std::size_t i = 0; i < followers.size(); ++i) {
          const int row = static_cast<int>(i);
          if (first_rows.valid[i] && rows.valid[i])
            distances[i].push_back(rowDistance(base->elementType(), first_rows.rows.row(row), rows.rows.row(row)));
        }
      }
      for (std::size_t i = 0; i < followers.size(); ++i) {
        if (distances[i].size() != kTriedSizes) continue;  // the larger neighbourhoods leave the image
        const std::optional<double> ratio = bestRatio(distances[i]);
        if (!ratio) continue;
        samples.push_back({first.corners[followers[i].first].match.disparity,
                           later.corners[followers[i].later].match.disparity, *ratio});
      }
    }
  }
  return samples;
}

std::vector<ShapeFit> fitShapes(const std::vector<SizeSample>& samples) {
  constexpr std::size_t kFewest = 30;
  if (samples.size() < kFewest)
    throw std::runtime_error(
        "only " + std::to_string(samples.size()) +
        " features could be followed, at least 30 are needed: give longer sequences with more motion");
  return {fitShape(samples, "a*d", false, false), fitShape(samples, "a*d+b", false, true),
          fitShape(samples, "a*d^b", true, false), fitShape(samples, "a*d^b+c", true, true)};
}

std::vector<CurveTrial> tryCurves(const std::vector<ReferenceSequence>& sequences, const ExperimentOptions& options,
                                  const std::vector<DepthScaleOptions>& curves, int features) {
  constexpr int kStride = 10, kSteps[] = {1, 4, 7, 10};
  constexpr double kTolerance = 3.0;  // px
  const FeatureExtractorOptions& extraction = options.stereo_features;
  DescriptorOptions left_view = extraction.descriptor;
  left_view.layout = DescriptorLayout::kLeft;
  const StereoDescriptor descriptor(left_view);
  const Reach reach = [&](double size) { return descriptor.reach(size); };
  DepthScaleOptions standard;
  standard.scale_normalisation = false;
  std::vector<DepthScale> all = {DepthScale(standard)};
  for (const DepthScaleOptions& curve : curves) all.emplace_back(curve);

  std::vector<double> total(all.size(), 0.0), gain(all.size(), 0.0);
  int pairs = 0;
  for (const ReferenceSequence& sequence : sequences) {
    std::vector<double> correct(all.size(), 0.0);
    Progress progress("trying curves " + sequence.name, sequence.frames / kStride + 1);
    for (int t = 0; t + 1 < sequence.frames; t += kStride, progress.step()) {
      const auto describe = [&](int i) {
        const KeypointSet set = findKeypoints(sequence.images, i, options);
        const auto chosen = selectKeypoints(set, all, reach, extraction.detector.bucket_size, features);
        return describeKeypoints(set, chosen, all, descriptor);
      };
      const std::vector<StereoFeatures> first = describe(t);
      for (const int step : kSteps) {
        if (t + step >= sequence.frames) continue;
        const std::vector<StereoFeatures> later = describe(t + step);
        for (std::size_t k = 0; k < all.size(); ++k)
          correct[k] += countCorrect(first[k], later[k], matchByDescriptor(first[k], later[k]),
                                     sequence.motion(t, t + step), kTolerance);
        ++pairs;
      }
    }
    for (std::size_t k = 0; k < all.size(); ++k) {
      total[k] += correct[k];
      gain[k] += 100.0 * (correct[k] / correct[0] - 1.0) / static_cast<double>(sequences.size());
    }
  }
  std::vector<CurveTrial> trials;
  for (std::size_t k = 0; k < curves.size(); ++k)
    trials.push_back({curves[k], total[k + 1] / std::max(pairs, 1), gain[k + 1]});
  return trials;
}

}  // namespace sdvo
