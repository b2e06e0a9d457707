#include "odometry_systems.hpp"

#include "../../src/common/progress.hpp"
#include "keypoint_set.hpp"

namespace sdvo {

const std::vector<OdometrySystem>& odometrySystems() {
  static const std::vector<OdometrySystem> systems = {{"standard", false, DescriptorLayout::kLeft},
                                                      {"scale_normalised", true, DescriptorLayout::kLeft},
                                                      {"left+right", false, DescriptorLayout::kLeftAndRight},
                                                      {"stereo", true, DescriptorLayout::kLeftAndRight}};
  return systems;
}

DescribedSequence describeSequence(const ReferenceSequence& sequence, const ExperimentOptions& options,
                                   double standard_size, int count) {
  const FeatureExtractorOptions& extraction = options.stereo_features;
  DepthScaleOptions normalised = extraction.sizeCurve(), constant = extraction.sizeCurve();
  normalised.scale_normalisation = true;
  constant.scale_normalisation = false;
  constant.constant_size = standard_size;
  const std::vector<DepthScale> curves = {DepthScale(constant), DepthScale(normalised)};
  DescriptorOptions both_views = extraction.descriptor;
  both_views.layout = DescriptorLayout::kLeftAndRight;
  const StereoDescriptor descriptor(both_views);
  const Reach reach = [&](double size) { return descriptor.reach(size); };

  const PatchLayout by_depth = PatchOptions().layout(), constant_layout{by_depth.side, by_depth.min_spacing, 0.f};

  const DepthScale odometry_curve(FeatureExtractorOptions().sizeCurve());
  DescribedSequence described;
  described.of_system.resize(odometrySystems().size());
  Progress progress("describing " + sequence.name, sequence.frames);
  for (int i = 0; i < sequence.frames; ++i, progress.step()) {
    const KeypointSet set = findKeypoints(sequence.images, i, options);
    const std::vector<int> chosen = selectKeypoints(set, curves, reach, extraction.detector.bucket_size, count);
    std::vector<int> all_rows;
    for (std::size_t k = 0; k < chosen.size(); ++k) all_rows.push_back(static_cast<int>(k));
    const std::vector<StereoFeatures> of_curve = describeKeypoints(set, chosen, curves, descriptor);
    for (std::size_t s = 0; s < odometrySystems().size(); ++s) {
      const OdometrySystem& system = odometrySystems()[s];
      described.of_system[s].push_back(
          selectRows(of_curve[system.scale_normalisation ? 1 : 0], all_rows, system.layout));
    }
    described.patches.constant.push_back(cutPatches(set, chosen, odometry_curve, constant_layout));
    described.patches.by_depth.push_back(cutPatches(set, chosen, odometry_curve, by_depth));
  }
  return described;
}

std::vector<Correspondence> makeCorrespondences(const StereoFeatures& reference, const StereoFeatures& current,
                                                const std::vector<FeatureMatch>& matches) {
  std::vector<Correspondence> correspondences;
  for (const FeatureMatch& match : matches)
    correspondences.push_back({reference.point(match.reference), current.measurement(match.current)});
  return correspondences;
}

}  // namespace sdvo
