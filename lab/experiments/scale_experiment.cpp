#include "scale_experiment.hpp"

#include <cmath>
#include <ctime>
#include <map>
#include <opencv2/features2d.hpp>

#include "../../src/common/progress.hpp"
#include "../../src/front_end/opencv_features.hpp"
#include "../../src/motion/correspondence_arrays.hpp"
#include "correct_matches.hpp"
#include "csv_table.hpp"
#include "keypoint_set.hpp"
#include "reference_sequence.hpp"

namespace sdvo {
namespace {

/// The features of a pair by one method, left view, and the CPU time that they took.
struct TimedFeatures {
  StereoFeatures features;
  double ms = 0.0;  ///< detection, stereo matching and description
};

double cpuMs() {
  return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

using Methods = std::map<std::string, TimedFeatures>;

/// Sizes by depth and constant ones on the same corners.
void describeBySize(const KeypointSet& set, double detection_ms, const ExperimentSetup& setup, DescriptorType type,
                    const ScaleExperiment& experiment, Methods& methods) {
  const FeatureExtractorOptions extraction = setup.withDescriptor(type).options().stereo_features;
  DescriptorOptions left_view = extraction.descriptor;
  left_view.layout = DescriptorLayout::kLeft;
  const StereoDescriptor descriptor(left_view);
  DepthScaleOptions by_depth = extraction.sizeCurve(), constant = by_depth;
  constant.scale_normalisation = false;
  constant.constant_size = experiment.standard_size;
  const std::vector<DepthScale> curves = {DepthScale(by_depth), DepthScale(constant)};
  const Reach reach = [&](double size) { return descriptor.reach(size); };
  const auto chosen = selectKeypoints(set, curves, reach, extraction.detector.bucket_size, experiment.features);
  for (const std::size_t c : {0u, 1u}) {
    const double begin = cpuMs();
    TimedFeatures& timed = methods[nameOf(type) + (c == 0 ? " by depth" : " constant")];
    timed.features = describeKeypoints(set, chosen, {curves[c]}, descriptor).front();
    timed.ms = detection_ms + cpuMs() - begin;
  }
}

/// Key points at the scale that the image itself shows, with OpenCV's detector of the descriptor.
void describeByImage(const KeypointSet& set, const cv::Ptr<cv::Feature2D>& feature, const std::string& descriptor,
                     const StereoMatcherOptions& stereo, const std::string& name, Methods& methods) {
  TimedFeatures& timed = methods[name];
  const double begin = cpuMs();
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat rows;
  feature->detectAndCompute(set.images.left, cv::noArray(), keypoints, rows);
  if (rows.type() == CV_32F) rows.convertTo(rows, CV_8U);  // SIFT: whole numbers in 0…255
  std::vector<cv::Point2f> positions;
  cv::KeyPoint::convert(keypoints, positions);
  StereoFeatures& features = timed.features;
  features.stamp = set.stamp;
  features.camera = set.camera;
  features.descriptor = descriptor;
  features.layout = DescriptorLayout::kLeft;
  features.element_type = descriptor == "sift" ? ElementType::kUint8 : ElementType::kBits;
  for (const StereoMatch& match : StereoMatcher(stereo).match(set.images.left, set.images.right, positions)) {
    const cv::KeyPoint& k = keypoints[static_cast<std::size_t>(match.left_index)];
    features.append({k.pt.x, k.pt.y, match.disparity, match.dv, k.size, -1.f, k.response});
    features.descriptors.push_back(rows.row(match.left_index));
  }
  timed.ms = cpuMs() - begin;
}

Methods describeAll(const ReferenceSequence& sequence, int i, const ExperimentSetup& setup,
                    const ScaleExperiment& experiment) {
  const ExperimentOptions options = setup.options();
  const FeatureExtractorOptions& extraction = options.stereo_features;
  const double begin = cpuMs();
  const KeypointSet set = findKeypoints(sequence.images, i, options);
  const double detection = cpuMs() - begin;
  Methods methods;
  // Stereo matching thins the key points of OpenCV's detectors: a quarter more leaves about as many (chosen).
  const int wanted = experiment.features * 5 / 4;
  describeBySize(set, detection, setup, DescriptorType::kFreak, experiment, methods);
  describeBySize(set, detection, setup, DescriptorType::kOrb, experiment, methods);
  describeByImage(set, cv::ORB::create(wanted), "orb", extraction.stereo, "orb own pyramid", methods);
#if SDVO_HAVE_SIFT
  describeBySize(set, detection, setup, DescriptorType::kSift, experiment, methods);
  describeByImage(set, cv::SIFT::create(wanted), "sift", extraction.stereo, "sift own scale", methods);
#endif
  return methods;
}

/// Counts of one method at one scale change.
struct Count {
  double visible = 0.0, correct = 0.0;
};

struct MethodScore {
  std::vector<Count> of_scale = std::vector<Count>(scaleChanges().size());
  double pairs = 0.0, views = 0.0, features = 0.0, ms = 0.0;
};

void compare(const StereoFeatures& first, const StereoFeatures& later, const Eigen::Isometry3d& T_later_first,
             MethodScore& score) {
  constexpr double kTolerance = 3.0;  // px, as in experiment A
  std::vector<int> match_of(static_cast<std::size_t>(first.count()), -1);
  for (const FeatureMatch& match : matchByDescriptor(first, later))
    match_of[static_cast<std::size_t>(match.reference)] = match.current;
  for (int i = 0; i < first.count(); ++i) {
    const Eigen::Vector3d before = first.point(i), point = T_later_first * before;
    if (point.z() < later.camera.nearestDepth()) continue;
    const Eigen::Vector3d seen = later.camera.project(point);
    if (seen.x() < 0.0 || seen.y() < 0.0 || seen.x() > later.camera.width - 1 || seen.y() > later.camera.height - 1)
      continue;
    const int scale = scaleIndex(before.z() / point.z());
    if (scale < 0) continue;
    Count& count = score.of_scale[static_cast<std::size_t>(scale)];
    ++count.visible;
    const int row = match_of[static_cast<std::size_t>(i)];
    if (row < 0) continue;
    const auto k = static_cast<std::size_t>(row);
    count.correct += std::hypot(later.u[k] - seen.x(), later.v[k] - seen.y()) <= kTolerance;
  }
  ++score.pairs;
}

}  // namespace

int scaleIndex(double ratio) {
  const std::vector<double>& changes = scaleChanges();
  constexpr double kOutside = 0.85;  // of the smallest, and its inverse of the largest: half of the step next to it
  if (ratio < kOutside * changes.front() || ratio > changes.back() / kOutside) return -1;
  std::size_t index = 0;
  while (index + 1 < changes.size() && ratio * ratio > changes[index] * changes[index + 1]) ++index;
  return static_cast<int>(index);
}

void runScaleChange(const ExperimentSetup& setup, const ScaleExperiment& experiment) {
  ExperimentOptions options = setup.options();
  const std::string hash = hashOptions(listOptions(options));
  CsvTable table({"sequence", "method", "scale", "visible", "correct", "percent", "pairs", "features", "ms_per_pair",
                  "reference", "options"});
  for (const std::string& name : setup.sequences) {
    const ReferenceSequence sequence = openSequence(setup, name, setup.reference);
    std::map<int, Methods> described;
    std::map<std::string, MethodScore> scores;
    const auto describe = [&](int i) -> const Methods& {
      if (described.count(i) == 0) {
        described[i] = describeAll(sequence, i, setup, experiment);
        for (const auto& [method, timed] : described[i]) {
          MethodScore& score = scores[method];
          ++score.views, score.ms += timed.ms, score.features += timed.features.count();
        }
      }
      return described[i];
    };
    Progress progress("scale change " + sequence.name, sequence.frames / experiment.stride + 1);
    for (int t = 0; t < sequence.frames; t += experiment.stride, progress.step())
      for (const int step : experiment.steps) {
        if (t + step >= sequence.frames) continue;
        const Methods &first = describe(t), &later = describe(t + step);
        for (const auto& [method, timed] : first)
          compare(timed.features, later.at(method).features, sequence.motion(t, t + step), scores[method]);
      }
    for (const auto& [method, score] : scores)
      for (std::size_t s = 0; s < scaleChanges().size(); ++s) {
        const Count& count = score.of_scale[s];
        table.add(sequence.name, method, scaleChanges()[s], count.visible, count.correct,
                  100.0 * count.correct / count.visible, score.pairs, score.features / score.views,
                  score.ms / score.views, nameOf(setup.reference), hash);
      }
  }
  table.write(setup.output + "/scale_change.csv");
}

}  // namespace sdvo
