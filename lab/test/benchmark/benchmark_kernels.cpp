// Times each kernel beside its plain twin: lab/run benchmark runs this.
#include <benchmark/benchmark.h>

#include <array>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "../../../src/common/kernel.hpp"
#include "../../../src/front_end/fast_corners.hpp"
#include "../../../src/front_end/freak.hpp"
#include "../../../src/front_end/stereo_matcher.hpp"
#include "../../../src/matching/patch_alignment.hpp"

namespace {

const cv::Size kSize(1241, 376);  // KITTI's most frequent one, odd
constexpr int kFeatures = 1100;

/// Every benchmark runs twice: 0 is the plain form, 1 the one with vectors.
class WithOrWithoutVectors {
 public:
  explicit WithOrWithoutVectors(const benchmark::State& state) { sdvo::allowVectorKernels(state.range(0) == 1); }
  ~WithOrWithoutVectors() { sdvo::allowVectorKernels(true); }
};

/// Texture with structure of some pixels; the right view sees it 20.4 px further left.
cv::Mat view(bool right) {
  cv::Mat noise(kSize.height, kSize.width + 40, CV_8U), smooth, wide;
  cv::RNG(3).fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, smooth, {}, 1.6);
  cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
  const cv::Matx23d shift(1.0, 0.0, right ? -20.4 : 0.0, 0.0, 1.0, 0.0);
  cv::warpAffine(smooth, wide, shift, kSize);
  return wide;
}

std::vector<cv::Point2f> positions() {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> u(60.f, 1180.f), v(40.f, 335.f);
  std::vector<cv::Point2f> all;
  for (int i = 0; i < kFeatures; ++i) all.emplace_back(u(random), v(random));
  return all;
}

void fastCorners(benchmark::State& state) {
  const WithOrWithoutVectors version(state);
  const cv::Mat image = view(false);
  for (auto _ : state) benchmark::DoNotOptimize(sdvo::findFastCorners(image, 12));
}

/// One form for all processors; beside it what OpenCV has for corners.
void cornerPeaks(benchmark::State& state) {
  const cv::Mat image = view(false);
  const auto corners = positions();
  const cv::TermCriteria until{cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 10, 0.02};
  for (auto _ : state)
    if (state.range(0) == 0) {
      auto refined = corners;
      cv::cornerSubPix(image, refined, {3, 3}, {-1, -1}, until);
    } else {
      for (const cv::Point2f& corner : corners) benchmark::DoNotOptimize(sdvo::cornerPeak(image, corner));
    }
}

void stereoMatch(benchmark::State& state) {
  const WithOrWithoutVectors version(state);
  const cv::Mat left = view(false), right = view(true);
  const auto corners = positions();
  const sdvo::StereoMatcher matcher({});
  for (auto _ : state) benchmark::DoNotOptimize(matcher.match(left, right, corners));
}

void freakInTwoViews(benchmark::State& state) {
  const WithOrWithoutVectors version(state);
  const cv::Mat left = view(false), right = view(true);
  std::vector<sdvo::ViewKeypoint> keypoints;
  cv::Mat rows(kFeatures, sdvo::Freak::kBytes, CV_8U);
  std::vector<std::uint8_t*> row;
  for (const cv::Point2f& p : positions()) {
    row.push_back(rows.ptr(static_cast<int>(keypoints.size())));
    keypoints.push_back({p.x, p.y, 7.f + 0.001f * p.x, -1.f});
  }
  for (auto _ : state)
    for (const cv::Mat& image : {left, right}) sdvo::Freak(image).describe(keypoints, row);
}

void patchAlignment(benchmark::State& state) {
  const WithOrWithoutVectors version(state);
  constexpr int kSide = 13;
  const cv::Mat image = view(false);
  std::vector<std::vector<std::uint8_t>> patches;
  for (const cv::Point2f& p : positions()) {
    cv::Mat patch;
    cv::getRectSubPix(image, {kSide, kSide}, p, patch);
    patches.emplace_back(patch.begin<std::uint8_t>(), patch.end<std::uint8_t>());
    cv::getRectSubPix(image, {kSide, kSide}, p + cv::Point2f(0.4f, -0.3f), patch);
    patches.emplace_back(patch.begin<std::uint8_t>(), patch.end<std::uint8_t>());
  }
  for (auto _ : state)
    for (std::size_t i = 0; i < patches.size(); i += 2)
      benchmark::DoNotOptimize(sdvo::alignPatch({}, {patches[i].data(), kSide, 1.f}, Eigen::Vector2f::Zero(),
                                                {patches[i + 1].data(), kSide, 1.f}, Eigen::Matrix2f::Identity()));
}

BENCHMARK(fastCorners)->Arg(0)->Arg(1);
BENCHMARK(cornerPeaks)->Arg(0)->Arg(1);
BENCHMARK(stereoMatch)->Arg(0)->Arg(1);
BENCHMARK(freakInTwoViews)->Arg(0)->Arg(1);
BENCHMARK(patchAlignment)->Arg(0)->Arg(1);

}  // namespace

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
