#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "../../src/front_end/feature_detector.hpp"
#include "../said.hpp"
#include "../synthetic_scene.hpp"
#include "../temporary_folder.hpp"

namespace sdvo::test_feature_detector {

constexpr int kBucket = 50;  // px
const cv::Size kSize(600, 400);

std::vector<int> bucketCounts(const std::vector<Corner>& corners, cv::Size size, int bucket) {
  const int columns = (size.width + bucket - 1) / bucket, rows = (size.height + bucket - 1) / bucket;
  std::vector<int> counts(static_cast<std::size_t>(columns) * rows, 0);
  for (const Corner& corner : corners)
    ++counts[static_cast<std::size_t>(static_cast<int>(corner.position.y) / bucket * columns +
                                      static_cast<int>(corner.position.x) / bucket)];
  return counts;
}

/// Corners everywhere, ten times fainter in the left half.
cv::Mat unevenTexture() {
  const synthetic::Texture texture(3, 6.0, 24.0);
  return synthetic::render(kSize, [&](double u, double v) {
    const double contrast = u < kSize.width / 2.0 ? 0.15 : 1.5;
    return 128.0 + contrast * (texture.at(u, v) - 128.0);
  });
}

/// Nothing but the part of it left of `column` is masked.
cv::Mat maskUpTo(int column) {
  cv::Mat mask(kSize, CV_8U, cv::Scalar(255));
  mask.colRange(0, column) = 0;
  return mask;
}

TEST(FeatureDetector, FindsNothingWhereTheMaskIsBlack) {
  const cv::Mat image = unevenTexture();
  FeatureDetectorOptions options;
  options.max_features = 300;
  options.subpixel = false;
  const FeatureDetector detector(options);
  const std::vector<Corner> corners = detector.detect(image, 10, maskUpTo(320));
  EXPECT_EQ(corners.size(), 300u);  // what is masked takes nothing from the rest
  for (const Corner& corner : corners) EXPECT_GE(corner.position.x, 320.f);
  EXPECT_TRUE(detector.detect(image, 10, cv::Mat::zeros(kSize, CV_8U)).empty());
}

TEST(FeatureDetector, TheMaskOfAFileHoldsUntilAnotherIsGiven) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "mask.png").string();
  const cv::Mat image = unevenTexture(), mask = maskUpTo(400);
  cv::imwrite(file, mask);
  FeatureDetectorOptions options;
  const auto positions = [&](const cv::Mat& given) {
    std::vector<cv::Point2f> found;
    for (const Corner& corner : FeatureDetector(options).detect(image, 0, given)) found.push_back(corner.position);
    return found;
  };
  const auto everywhere = positions(cv::Mat()), right = positions(mask), none = positions(maskUpTo(kSize.width));
  ASSERT_FALSE(right.empty());
  ASSERT_NE(everywhere, right);
  options.mask = file;
  EXPECT_EQ(positions(cv::Mat()), right);
  EXPECT_EQ(positions(maskUpTo(kSize.width)), none);
  EXPECT_EQ(positions(maskUpTo(0)), everywhere);
}

TEST(FeatureDetector, AMaskThatDoesNotFitIsNamed) {
  const cv::Mat image = unevenTexture();
  const auto errorWith = [&](const cv::Mat& mask) {
    return errorOf([&] { FeatureDetector({}).detect(image, 0, mask); });
  };
  expectWords(errorWith(cv::Mat::zeros(100, 200, CV_8U)), {"200x100", "600x400", "rectified left image"});
  expectWords(errorWith(cv::Mat::zeros(image.size(), CV_8UC3)), {"mask", "one channel"});

  const TemporaryFolder folder;
  const std::string pipe = (folder.path() / "pipe").string(), png = (folder.path() / "mask.png").string();
  const auto errorOfFile = [](const std::string& file) {
    FeatureDetectorOptions options;
    options.mask = file;
    return errorOf([&] { FeatureDetector{options}; });
  };
  expectWords(errorOfFile("/nowhere/mask.png"), {"mask", "PNG", "'/nowhere/mask.png'"});
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  expectWords(errorOfFile(pipe), {"mask", "PNG", pipe});
  // The header alone, of a huge one and of one that ends early.
  cv::imwrite(png, maskUpTo(10));
  std::fstream stream(png, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(16);
  const char huge[] = {0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30, 8, 0, 0, 0, 0, 0x43, 0x4c, static_cast<char>(0xa7), 0x66};
  stream.write(huge, sizeof huge);
  stream.close();
  EXPECT_EQ(errorOfFile(png),
            "mask: '" + png + "' has 30000x30000 px: a mask has the size of the rectified left image");
  cv::imwrite(png, maskUpTo(10));
  std::filesystem::resize_file(png, std::filesystem::file_size(png) / 2);
  EXPECT_EQ(errorOfFile(png), "mask: cannot read all of the PNG '" + png + "': is it truncated?");
  // Where a nodelet's folder is not the user's.
  EXPECT_EQ(errorOfFile("~/mask.png"),
            "mask: cannot read a PNG from '" + std::filesystem::current_path().string() + "/~/mask.png'");
}

TEST(FeatureDetector, TheSmallestImageIsSearchedAndASmallerOneIsNot) {
  constexpr int kSide = FeatureDetector::kSmallestSide, kMiddle = kSide / 2;
  cv::Mat image(kSide, kSide, CV_8U, cv::Scalar(50));
  image(cv::Rect(kMiddle, kMiddle, kSide - kMiddle, kSide - kMiddle)).setTo(200);
  FeatureDetectorOptions options;
  options.type = DetectorType::kGftt;
  const FeatureDetector detector(options);
  EXPECT_FALSE(detector.detect(image).empty());
  EXPECT_TRUE(detector.detect(image.colRange(1, kSide)).empty());
  EXPECT_TRUE(detector.detect(image.rowRange(1, kSide)).empty());
}

TEST(SpreadOverBuckets, ServesEveryBucketBeforeASecondTime) {
  std::mt19937 random(1);
  std::vector<Corner> corners;
  for (int i = 0; i < 500; ++i)  // one crowded bucket of strong corners
    corners.push_back({cv::Point2f(random() % 50, random() % 50), 1000.f + static_cast<float>(i)});
  for (int column = 1; column < 12; ++column)  // a weak one in each of the others
    for (int row = 0; row < 8; ++row) corners.push_back({cv::Point2f(column * 50 + 7, row * 50 + 7), 1.f});

  const std::vector<int> counts = bucketCounts(spreadOverBuckets(corners, kSize, kBucket, 100), kSize, kBucket);
  EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), 0), 100);
  for (int column = 1; column < 12; ++column)
    for (int row = 0; row < 8; ++row) EXPECT_EQ(counts[static_cast<std::size_t>(row * 12 + column)], 1);
  EXPECT_EQ(counts[0], 100 - 11 * 8);
}

TEST(SpreadOverBuckets, KeepsTheStrongestOfABucket) {
  std::vector<Corner> corners;
  for (int i = 0; i < 20; ++i) corners.push_back({cv::Point2f(i, i), static_cast<float>((i * 7) % 20)});
  const std::vector<Corner> kept = spreadOverBuckets(corners, kSize, kBucket, 5);
  ASSERT_EQ(kept.size(), 5u);
  for (const Corner& corner : kept) EXPECT_GE(corner.response, 15.f);
}

TEST(SpreadOverBuckets, TheLastRoundGoesToTheStrongestOfAllBuckets) {
  std::vector<Corner> corners;
  for (int bucket = 0; bucket < 4; ++bucket)
    for (int i = 0; i < 2; ++i)
      corners.push_back({cv::Point2f(50.f * bucket + 5.f + i, 5.f), 100.f - 50.f * i + static_cast<float>(bucket)});
  const std::vector<Corner> kept = spreadOverBuckets(corners, kSize, kBucket, 6);
  ASSERT_EQ(kept.size(), 6u);
  std::multiset<float> responses;
  for (const Corner& corner : kept) responses.insert(corner.response);
  EXPECT_EQ(responses, (std::multiset<float>{100.f, 101.f, 102.f, 103.f, 52.f, 53.f}));
}

TEST(SpreadOverBuckets, DoesNotDependOnTheOrderOfTheInput) {
  std::mt19937 random(2);
  std::vector<Corner> corners;
  for (int i = 0; i < 2000; ++i)  // many equal responses
    corners.push_back({cv::Point2f(random() % 600, i % 400), static_cast<float>(random() % 4)});
  const std::vector<Corner> expected = spreadOverBuckets(corners, kSize, kBucket, 300);
  std::shuffle(corners.begin(), corners.end(), random);
  const std::vector<Corner> shuffled = spreadOverBuckets(corners, kSize, kBucket, 300);
  ASSERT_EQ(shuffled.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(shuffled[i].position, expected[i].position);
}

TEST(SpreadOverBuckets, TakesPositionsOutsideTheImage) {
  const std::vector<Corner> corners = {{cv::Point2f(-3.f, -2.f), 1.f}, {cv::Point2f(700.f, 500.f), 1.f}};
  EXPECT_EQ(spreadOverBuckets(corners, kSize, kBucket, 10).size(), 2u);
  EXPECT_TRUE(spreadOverBuckets({}, kSize, kBucket, 10).empty());
}

double apart(const Corner& a, const Corner& b) {
  return cv::norm(a.position - b.position);
}

double nearestOther(const std::vector<Corner>& corners, const Corner& corner) {
  double nearest = 1e9;
  for (const Corner& other : corners)
    if (&other != &corner) nearest = std::min(nearest, apart(corner, other));
  return nearest;
}

TEST(KeepApart, LeavesOutExactlyWhatLiesNearerToAStrongerOne) {
  std::mt19937 random(5);
  std::vector<Corner> corners;
  for (int i = 0; i < 3000; ++i)
    corners.push_back(
        {cv::Point2f(static_cast<float>(random() % 6000) / 10.f, static_cast<float>(random() % 4000) / 10.f),
         static_cast<float>(random() % 40)});
  for (const double spacing : {0.4, 1.0, 4.0, 23.5}) {
    const std::vector<Corner> kept = keepApart(corners, spacing);
    for (const Corner& corner : kept) EXPECT_GE(nearestOther(kept, corner), spacing);
    for (const Corner& corner : corners)  // what is kept explains itself: it lies at its own place
      EXPECT_TRUE(std::any_of(kept.begin(), kept.end(), [&](const Corner& other) {
        return other.response >= corner.response && apart(corner, other) < spacing;
      }));
    std::shuffle(corners.begin(), corners.end(), random);
    const std::vector<Corner> again = keepApart(corners, spacing);
    ASSERT_EQ(again.size(), kept.size());
    for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(again[i].position, kept[i].position);
  }
}

TEST(KeepApart, NoSpacingLeavesEverythingAsItIs) {
  const std::vector<Corner> corners = {{{5.f, 5.f}, 1.f}, {{5.f, 5.f}, 3.f}, {{5.5f, 5.f}, 2.f}};
  EXPECT_EQ(keepApart(corners, 0.0).size(), 3u);
  EXPECT_EQ(keepApart(corners, 0.0).front().response, 1.f);
  EXPECT_EQ(keepApart(corners, 0.6).size(), 1u);
  EXPECT_EQ(keepApart(corners, 0.6).front().response, 3.f);
  EXPECT_TRUE(keepApart({}, 4.0).empty());
  EXPECT_EQ(keepApart({{{600.f, 5.f}, 1.f}, {{600.f, 5.f}, 3.f}}, 1e-7).size(), 1u);
}

TEST(FeatureDetector, KeepsCornersApart) {
  FeatureDetectorOptions options;
  options.subpixel = false;
  options.max_features = 5000;
  const std::vector<Corner> all = FeatureDetector(options).detect(unevenTexture());
  options.min_spacing = 6.0;
  const std::vector<Corner> fewer = FeatureDetector(options).detect(unevenTexture());
  const auto nearestOf = [](const std::vector<Corner>& corners) {
    double nearest = 1e9;
    for (const Corner& corner : corners) nearest = std::min(nearest, nearestOther(corners, corner));
    return nearest;
  };
  EXPECT_LT(nearestOf(all), 4.0);
  EXPECT_GE(nearestOf(fewer), 6.0);
  EXPECT_GT(fewer.size(), 200u);
}

/// A border hides its features; the others are where the whole image has them.
TEST(FeatureDetector, BorderLeavesPositionsWhereTheyAre) {
  constexpr int kBorder = 40;
  const cv::Mat image = unevenTexture();
  FeatureDetectorOptions options;
  options.max_features = 20000;
  options.subpixel = false;
  const std::vector<Corner> of_image = FeatureDetector(options).detect(image);
  const std::vector<Corner> inner = FeatureDetector(options).detect(image, kBorder);
  ASSERT_GT(inner.size(), 50u);
  const cv::Rect2f visible(kBorder, kBorder, kSize.width - 2.f * kBorder, kSize.height - 2.f * kBorder);
  // Whether a corner is the strongest around depends at the very border on what is hidden there.
  const cv::Rect2f clear(visible.x + 5.f, visible.y + 5.f, visible.width - 10.f, visible.height - 10.f);
  for (const Corner& corner : inner) {
    const bool known = std::any_of(of_image.begin(), of_image.end(),
                                   [&](const Corner& other) { return other.position == corner.position; });
    EXPECT_TRUE(known || !clear.contains(corner.position)) << corner.position;
    EXPECT_TRUE(visible.contains(corner.position)) << corner.position;
  }
}

TEST(FeatureDetector, CornerQualityIsARatioOfContrastsSquared) {
  cv::Mat image(kSize, CV_8U, cv::Scalar(40));
  image(cv::Rect(100, 100, 60, 60)).setTo(240);  // contrast 200
  image(cv::Rect(400, 100, 60, 60)).setTo(100);  // and 60, whose eigenvalues are 0.09 of the others'
  for (const auto& [quality, faint] : std::vector<std::pair<double, bool>>{{0.05, true}, {0.15, false}}) {
    FeatureDetectorOptions options;
    options.type = DetectorType::kGftt;
    options.corner_quality = quality;
    bool found[2] = {false, false};
    for (const Corner& corner : FeatureDetector(options).detect(image)) found[corner.position.x > 300.f] = true;
    EXPECT_TRUE(found[0]) << "quality " << quality;
    EXPECT_EQ(found[1], faint) << "quality " << quality;
  }
}

/// What a refinement carries further away is another point.
TEST(FeatureDetector, RefinedPositionsStayNear) {
  const cv::Mat image = unevenTexture();
  for (const auto& [type, largest] :
       std::vector<std::pair<DetectorType, float>>{{DetectorType::kFast, 1.f}, {DetectorType::kGftt, 2.5f}}) {
    FeatureDetectorOptions options;
    options.type = type;
    options.corner_quality = 1e-6;
    options.subpixel = false;
    const std::vector<Corner> whole = FeatureDetector(options).detect(image);
    options.subpixel = true;
    const std::vector<Corner> refined = FeatureDetector(options).detect(image);
    ASSERT_EQ(whole.size(), refined.size());
    std::size_t moved = 0;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      const cv::Point2f shift = refined[i].position - whole[i].position;
      EXPECT_LE(std::max(std::abs(shift.x), std::abs(shift.y)), largest + 1e-4f) << nameOf(type);
      moved += shift != cv::Point2f();
    }
    EXPECT_GT(moved, 10u) << nameOf(type);
  }
}

/// The scene at a share of its contrast, with noise of `sigma` grey levels.
cv::Mat inLight(double light, double sigma) {
  const synthetic::Texture texture(3, 6.0, 24.0);
  cv::RNG random(5);
  return synthetic::render(
      kSize, [&](double u, double v) { return 128.0 + light * (texture.at(u, v) - 128.0) + random.gaussian(sigma); });
}

TEST(FeatureDetector, WeakestCornerFollowsTheNoiseAndNotTheLight) {
  FeatureDetectorOptions options;
  options.max_features = 300;
  for (const auto& [light, sigma] : std::vector<std::pair<double, double>>{{1.0, 0.3}, {0.15, 0.3}, {1.0, 2.0}}) {
    const std::vector<Corner> corners = FeatureDetector(options).detect(inLight(light, sigma));
    EXPECT_EQ(corners.size(), 300u) << light << " " << sigma;
    for (const Corner& corner : corners) EXPECT_GE(corner.response, 4.9 * sigma) << light << " " << sigma;
  }
}

/// However strong it is: at most a corner in 250 px.
TEST(FeatureDetector, NoiseAloneHasFewCorners) {
  FeatureDetectorOptions options;
  options.max_features = 3000;
  for (const double sigma : {2.0, 4.0, 16.0})
    EXPECT_LT(FeatureDetector(options).detect(inLight(0.0, sigma)).size(), 960u) << sigma;
}

class EveryDetector : public testing::TestWithParam<const char*> {
 protected:
  static FeatureDetectorOptions options() {
    FeatureDetectorOptions options;
    options.type = valueOf<DetectorType>(GetParam());
    options.bucket_size = kBucket;
    options.min_contrast = 5.0;
    options.corner_quality = 1e-6;
    return options;
  }
};

/// Those that look at the full image alone, whose positions are those of corners; the others find blobs at any scale.
class CornerDetector : public EveryDetector {};

TEST_P(CornerDetector, SpreadsCornersEvenlyOverAnUnevenImage) {
  FeatureDetectorOptions uneven = options();
  uneven.max_features = 2 * 12 * 8;  // two for every bucket
  uneven.subpixel = false;           // refinement may carry a corner over the edge of its bucket
  const std::vector<Corner> corners = FeatureDetector(uneven).detect(unevenTexture());
  EXPECT_EQ(corners.size(), 192u);
  for (const int count : bucketCounts(corners, kSize, kBucket)) EXPECT_EQ(count, 2);
}

TEST_P(EveryDetector, RespectsTheLargestNumber) {
  const cv::Mat image = unevenTexture();
  for (const int max_features : {1, 37, 150}) {
    FeatureDetectorOptions few = options();
    few.max_features = max_features;
    EXPECT_EQ(FeatureDetector(few).detect(image).size(), static_cast<std::size_t>(max_features));
  }
}

TEST_P(EveryDetector, FindsNothingInABlankImage) {
  for (const int grey : {0, 128, 255})
    EXPECT_TRUE(FeatureDetector(options()).detect(cv::Mat(kSize, CV_8U, cv::Scalar(grey))).empty()) << grey;
}

TEST_P(EveryDetector, StaysInsideTheImage) {
  for (const Corner& corner : FeatureDetector(options()).detect(unevenTexture())) {
    EXPECT_TRUE(corner.position.x >= 0.f && corner.position.x <= kSize.width - 1.f) << corner.position;
    EXPECT_TRUE(corner.position.y >= 0.f && corner.position.y <= kSize.height - 1.f) << corner.position;
  }
}

/// Differences found - true (px) of those true positions near which a corner was found at all.
std::vector<std::pair<std::size_t, cv::Point2d>> locationErrors(const std::vector<Corner>& corners,
                                                                const std::vector<cv::Point2d>& truth) {
  constexpr double kSearchRadius = 4.0;  // px
  std::vector<std::pair<std::size_t, cv::Point2d>> errors;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    cv::Point2d nearest(kSearchRadius, kSearchRadius);
    for (const Corner& corner : corners) {
      const cv::Point2d difference = cv::Point2d(corner.position) - truth[i];
      if (cv::norm(difference) < cv::norm(nearest)) nearest = difference;
    }
    if (cv::norm(nearest) < kSearchRadius) errors.emplace_back(i, nearest);
  }
  return errors;
}

/// Positions from `first` px on, `step` px apart, each at another fraction of a pixel.
std::vector<cv::Point2d> offTheGrid(int rows, int columns, double first, double step) {
  std::vector<cv::Point2d> positions;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      positions.emplace_back(first + step * column + 0.083 * row - 0.4, first + step * row + 0.067 * column - 0.45);
  return positions;
}

TEST_P(CornerDetector, LocatesDotsBetweenPixels) {
  // All gradients of a round dot point at its centre, so that its position is not a matter of definition.
  constexpr double kTolerance = 0.15, kSigma = 1.3;  // px
  const std::vector<cv::Point2d> truth = offTheGrid(9, 14, 30.0, 40.0);
  const cv::Mat image = synthetic::render(kSize, [&](double u, double v) {
    double sum = 40.0;
    for (const cv::Point2d& dot : truth)
      sum += 180.0 * std::exp(-0.5 * ((u - dot.x) * (u - dot.x) + (v - dot.y) * (v - dot.y)) / (kSigma * kSigma));
    return sum;
  });
  FeatureDetectorOptions precise = options();
  precise.corner_quality = 0.1;
  const auto errors = locationErrors(FeatureDetector(precise).detect(image), truth);
  EXPECT_GE(errors.size(), truth.size() * 9 / 10);
  cv::Point2d offset;
  for (const auto& [i, error] : errors) {
    EXPECT_LT(cv::norm(error), kTolerance) << "at " << truth[i] << " by " << error;
    offset += error / static_cast<double>(errors.size());
  }
  // Errors of single corners average out; an offset of the coordinates would remain.
  EXPECT_NEAR(offset.x, 0.0, 0.03);
  EXPECT_NEAR(offset.y, 0.0, 0.03);
}

#if CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 4)
INSTANTIATE_TEST_SUITE_P(Types, EveryDetector, testing::Values("fast", "gftt", "orb", "sift"));
#else
INSTANTIATE_TEST_SUITE_P(Types, EveryDetector, testing::Values("fast", "gftt", "orb"));
#endif
INSTANTIATE_TEST_SUITE_P(Types, CornerDetector, testing::Values("fast", "gftt"));

}  // namespace sdvo::test_feature_detector
