#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <random>

#include "draws.hpp"
#include "said.hpp"
#include "stereo_descriptor_vo/common/stereo_features.hpp"

/// Synthetic images and features whose truth is known analytically; for the tests of the core.
namespace sdvo::synthetic {

using sdvo::errorOf;

/// A rig like KITTI's at a size that renders quickly.
inline StereoCamera camera() {
  return {400.0, 410.0, 322.5, 236.25, 0.5, 640, 480};
}

/// A smooth random function of the plane: sinusoids in random directions, the same power in every octave between two
/// wavelengths. It can be evaluated anywhere, and sampling it at less than half the shortest wavelength loses nothing,
/// so an image of it is exact to the rounding of its grey levels.
class Texture {
 public:
  Texture(unsigned seed, double shortest_wavelength, double longest_wavelength) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    constexpr int kWavesPerOctave = 9;
    for (double wavelength = shortest_wavelength; wavelength <= longest_wavelength; wavelength *= 2.0) {
      for (int i = 0; i < kWavesPerOctave; ++i) {
        const double length = std::min(wavelength * std::pow(2.0, uniform(random)), longest_wavelength);
        const double direction = 2.0 * CV_PI * uniform(random);
        waves_.push_back({std::cos(direction) / length, std::sin(direction) / length, uniform(random)});
      }
    }
    constexpr double kStandardDeviation = 35.0;  // grey levels; 3.6 of them reach the ends of 0…255
    amplitude_ = kStandardDeviation * std::sqrt(2.0 / static_cast<double>(waves_.size()));
  }

  /// Grey level around 128, not limited to 0…255.
  double at(double x, double y) const {
    double sum = 0.0;
    for (const Wave& wave : waves_) sum += sine(wave.kx * x + wave.ky * y + wave.phase);
    return 128.0 + amplitude_ * sum;
  }

 private:
  struct Wave {
    double kx, ky, phase;  ///< turns per unit of length, turns
  };

  /// Sine of an angle in turns from an interpolated table: exact to 3e-7 and several times faster than std::sin.
  static double sine(double turns) {
    constexpr int kSteps = 4096;
    static const std::vector<double> table = [] {
      std::vector<double> values(kSteps + 2);
      for (int i = 0; i < kSteps + 2; ++i) values[static_cast<std::size_t>(i)] = std::sin(2.0 * CV_PI * i / kSteps);
      return values;
    }();
    const double position = (turns - std::floor(turns)) * kSteps;
    const std::size_t i = static_cast<std::size_t>(position);
    const double share = position - static_cast<double>(i);
    return (1.0 - share) * table[i] + share * table[i + 1];
  }

  std::vector<Wave> waves_;
  double amplitude_ = 0.0;
};

/// Image of a function of the pixel position.
inline cv::Mat render(cv::Size size, const std::function<double(double u, double v)>& grey) {
  cv::Mat image(size, CV_8U);
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) image.at<std::uint8_t>(v, u) = cv::saturate_cast<std::uint8_t>(grey(u, v));
  return image;
}

/// Image of a texture in pixels, moved by so many to the left and down.
inline cv::Mat render(cv::Size size, const Texture& texture, double left = 0.0, double down = 0.0) {
  return render(size, [&](double u, double v) { return texture.at(u + left, v - down); });
}

/// Grey levels without any order.
inline cv::Mat noise(cv::Size size, unsigned seed) {
  cv::Mat image(size, CV_8U);
  cv::RNG(seed).fill(image, cv::RNG::UNIFORM, 0, 256);
  return image;
}

/// Mean grey level of a square, pixel by pixel: pixel p covers [p - 0.5, p + 0.5].
inline double meanByArea(const cv::Mat& image, double u, double v, double half_side) {
  const auto overlap = [&](int pixel, double centre) {
    return std::max(0.0, std::min(pixel + 0.5, centre + half_side) - std::max(pixel - 0.5, centre - half_side));
  };
  double sum = 0.0;
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) sum += overlap(x, u) * overlap(y, v) * image.at<std::uint8_t>(y, x);
  return sum / (4.0 * half_side * half_side);
}

/// View of the fronto-parallel plane at `depth` m that carries `texture` (in m) from a camera whose centre is `x` m to
/// the right of the texture's origin.
inline cv::Mat renderPlane(const Texture& texture, const StereoCamera& camera, double depth, double x = 0.0) {
  return render({camera.width, camera.height}, [&](double u, double v) {
    return texture.at((u - camera.cx) * depth / camera.fx + x, (v - camera.cy) * depth / camera.fy);
  });
}

/// The images of both cameras.
struct Views {
  cv::Mat left, right;
};

/// A textured plane at `depth` m across the optical axis; wavelengths from 6 px on.
inline Views planeAt(double depth, unsigned seed = 31) {
  const double metres_per_pixel = depth / camera().fx;
  const Texture texture(seed, 6.0 * metres_per_pixel, 96.0 * metres_per_pixel);
  return {renderPlane(texture, camera(), depth), renderPlane(texture, camera(), depth, camera().baseline)};
}

/// A row of random bits.
inline std::vector<std::uint8_t> randomRow(std::mt19937& random, int bytes) {
  std::vector<std::uint8_t> row(static_cast<std::size_t>(bytes));
  for (std::uint8_t& byte : row) byte = static_cast<std::uint8_t>(random() & 0xff);
  return row;
}

/// An empty feature set as the extractor would send it.
inline StereoFeatures noFeatures(const StereoCamera& rig, std::int64_t stamp = 0, int bytes = 128) {
  StereoFeatures features;
  features.stamp = stamp;
  features.camera = rig;
  features.descriptor = "freak";
  features.layout = DescriptorLayout::kLeftAndRight;
  features.descriptors.create(0, bytes, CV_8U);
  return features;
}

/// Adds one feature; `row` must have the width of the set's descriptors.
inline void addFeature(StereoFeatures& features, double u, double v, double disparity,
                       const std::vector<std::uint8_t>& row) {
  features.append({static_cast<float>(u), static_cast<float>(v), static_cast<float>(disparity), 0.f, 10.f, -1.f, 1.f});
  features.descriptors.push_back(
      cv::Mat(1, static_cast<int>(row.size()), CV_8U, const_cast<std::uint8_t*>(row.data())));
}

/// Adds the features of another set, with their positions and descriptors alone.
inline void addAll(StereoFeatures& features, const StereoFeatures& others) {
  for (int row = 0; row < others.count(); ++row)
    addFeature(features, others.u[row], others.v[row], others.disparity[row],
               {others.descriptors.ptr(row), others.descriptors.ptr(row) + others.descriptors.cols});
}

/// Points with a descriptor of their own each.
struct World {
  std::vector<Eigen::Vector3d> points;  ///< m
  std::vector<std::vector<std::uint8_t>> rows;
};

/// `count` points, uniform in a box.
inline World randomWorld(unsigned seed, int count, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                         int bytes = 128) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  World world;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d share = draw<3>(uniform, random);
    world.points.push_back(low + share.cwiseProduct(high - low));
    world.rows.push_back(randomRow(random, bytes));
  }
  return world;
}

/// How a World is seen.
struct Sighting {
  double noise = 0.0;       ///< standard deviation of u_left, v and u_right each, px
  double flipped = 0.0;     ///< share of the descriptor bits that differ from the world's
  int strangers = 0;        ///< features with descriptors that nothing else has
  double min_depth = 2.0;   ///< m
  double max_depth = 40.0;  ///< m
  unsigned seed = 1;
};

/// The features that a rig at T_camera_world sees of a world, in random order.
inline StereoFeatures observe(const World& world, const StereoCamera& rig, const Eigen::Isometry3d& T_camera_world,
                              std::int64_t stamp, const Sighting& sighting = {}) {
  std::mt19937 random(sighting.seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<std::size_t> order(world.points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random);

  StereoFeatures features = noFeatures(rig, stamp, static_cast<int>(world.rows.front().size()));
  for (const std::size_t i : order) {
    const Eigen::Vector3d point = T_camera_world * world.points[i];
    if (point.z() < sighting.min_depth || point.z() > sighting.max_depth) continue;
    Eigen::Vector3d pixel = rig.project(point);
    for (int k = 0; k < 3; ++k) pixel[k] += sighting.noise * normal(random);
    const double disparity = pixel[0] - pixel[2];
    if (pixel[0] < 0.0 || pixel[0] > rig.width - 1.0 || pixel[1] < 0.0 || pixel[1] > rig.height - 1.0 ||
        pixel[2] < 0.0 || disparity < 0.5)
      continue;
    std::vector<std::uint8_t> row = world.rows[i];
    if (sighting.flipped > 0.0)
      for (std::uint8_t& byte : row)
        for (int bit = 0; bit < 8; ++bit)
          if (uniform(random) < sighting.flipped) byte = static_cast<std::uint8_t>(byte ^ (1 << bit));
    addFeature(features, pixel[0], pixel[1], disparity, row);
  }
  for (int i = 0; i < sighting.strangers; ++i) {
    const std::vector<std::uint8_t> row = randomRow(random, static_cast<int>(world.rows.front().size()));
    const Eigen::Vector3d share = draw<3>(uniform, random);
    addFeature(features, share.x() * (rig.width - 1.0), share.y() * (rig.height - 1.0), 1.0 + 40.0 * share.z(), row);
  }
  return features;
}

/// Share of the bits in which two rows of the same width differ.
inline double differingBits(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_HAMMING) / (8.0 * static_cast<double>(a.total()));
}

inline bool equalMats(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) return false;
  return a.empty() || cv::norm(a, b, cv::NORM_INF) == 0.0;
}

/// All of each feature but its patch.
inline void expectEqual(const StereoFeatures& a, const StereoFeatures& b) {
  EXPECT_EQ(a.u, b.u);
  EXPECT_EQ(a.v, b.v);
  EXPECT_EQ(a.disparity, b.disparity);
  EXPECT_EQ(a.dv, b.dv);
  EXPECT_EQ(a.size, b.size);
  EXPECT_EQ(a.angle, b.angle);
  EXPECT_EQ(a.response, b.response);
  EXPECT_TRUE(equalMats(a.descriptors, b.descriptors));
}

}  // namespace sdvo::synthetic
