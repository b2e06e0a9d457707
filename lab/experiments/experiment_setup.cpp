#include "experiment_setup.hpp"

namespace sdvo {

const std::vector<SetupDifference>& paperDifferences() {
  // The paper fits its sizes to matching alone; these find most matches of FREAK on drives that are not reported.
  static const std::vector<SetupDifference> differences = {
      {"whole pixels", {"detector/subpixel=false"}, {"detector/subpixel=true"}},
      {"orientation", {"descriptor/oriented=true"}, {"descriptor/oriented=false"}},
      {"sizes for matching",
       {"size_curve/slope=0.7", "size_curve/min_size=14", "size_curve/max_size=60"},
       {"size_curve/slope=0", "size_curve/min_size=0", "size_curve/max_size=0"},
       true},
  };
  return differences;
}

const std::vector<SetupDifference>& otherDifferences() {
  static const std::vector<SetupDifference> differences = {
      {"spacing 4 px", {"detector/min_spacing=4"}, {}},
      {"inside the image", {"descriptor/extend_border=false"}, {}},
      {"strong corners", {"detector/min_contrast=28"}, {}},
  };
  return differences;
}

namespace {

/// Options by name that are the paper's whatever the nodelets' defaults are.
const std::vector<std::string> kFixed = {"detector/type=fast", "detector/min_spacing=0",
                                         "stereo/max_epipolar_residual=1.5", "descriptor/extend_border=true"};

/// SIFT's sizes in the paper's set-up; those of FREAK stand among its differences.
const std::vector<std::string> kSiftSizes = {"size_curve/slope=0.2", "size_curve/min_size=4", "size_curve/max_size=32"};

/// The same for fields without a name. Corners are of at least 3 grey levels in every image: a loose threshold, by
/// which the paper's largest sets have 2320 features.
void fix(ExperimentOptions& options) {
  options.noise = 0.5;
  options.tracks = true;
  FeatureExtractorOptions& features = options.stereo_features;
  features.detector.bucket_size = 50;
  features.stereo.min_disparity = 0.5;
}

}  // namespace

std::vector<Ablation> ablations() {
  std::vector<Ablation> all;
  for (const Setup setup : {Setup::kProduct, Setup::kPaper}) all.push_back({setup, "as it is", {}});
  for (const SetupDifference& difference : paperDifferences()) {
    all.push_back({Setup::kProduct, "with " + difference.name, difference.with});
    all.push_back({Setup::kPaper, "without " + difference.name, difference.without});
  }
  for (const SetupDifference& difference : otherDifferences())
    for (const Setup setup : {Setup::kProduct, Setup::kPaper})
      all.push_back({setup, "with " + difference.name, difference.with});
  return all;
}

ExperimentOptions ExperimentSetup::options() const {
  const auto read = [this](DescriptorType type) {
    // A loose threshold, as in the paper: weak corners belong to the large feature sets.
    std::vector<std::string> all = {"stereo_features/detector/max_features=5000", "detector/min_contrast=6"};
    if (setup == Setup::kPaper) {
      all.insert(all.end(), kFixed.begin(), kFixed.end());
      for (const SetupDifference& difference : paperDifferences())
        if (type == DescriptorType::kFreak || !difference.of_freak)
          all.insert(all.end(), difference.with.begin(), difference.with.end());
      if (type == DescriptorType::kSift) all.insert(all.end(), kSiftSizes.begin(), kSiftSizes.end());
    }
    all.insert(all.end(), settings.begin(), settings.end());
    ExperimentOptions options{readPipelineOptions("", all)};
    options.stereo_features.detector.corner_quality = 0.0002;
    if (setup == Setup::kPaper) fix(options);
    return options;
  };
  return read(read(DescriptorType::kFreak).stereo_features.descriptor.type);
}

ExperimentSetup ExperimentSetup::withDescriptor(DescriptorType type) const {
  ExperimentSetup other = *this;
  other.settings.push_back("descriptor/type=" + nameOf(type));
  return other;
}

}  // namespace sdvo
