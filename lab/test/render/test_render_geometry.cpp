#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "../../render/drive_renderer.hpp"
#include "../../render/rigs.hpp"

namespace sdvo::render::test_render_geometry {

/// A world of its own with flat light: what is seen depends on reflectance alone.
World plainWorld(Mesh mesh, const Texture& texture) {
  World world;
  world.mesh = std::move(mesh);
  world.textures = std::make_shared<TextureSet>(texture);
  world.ambient = 1.0 / 0.75;  // what stands upright sees three quarters of the sky
  world.sun = 0.0;
  world.haze_distance = 0.0;
  world.sky = 0.0f;
  return world;
}

/// Renders a world without traffic through any view.
class Studio {
 public:
  explicit Studio(World world)
      : world_(std::move(world)),
        device_(1),
        caster_(device_, world_.mesh),
        nothing_(device_, no_casters_),
        renderer_(world_, caster_, no_models_) {}

  cv::Mat1f render(const View& view, int samples = 4) const {
    cv::Mat1f image(view.height, view.width, 0.0f);
    renderer_.add(view, nothing_, samples, 0.0f, 0.0f, 1.0f, image);
    return image;
  }
  cv::Mat1f depth(const View& view) const { return renderer_.trace(view, nothing_).depth; }

 private:
  World world_;
  Device device_;
  RayCaster caster_;
  std::vector<RayCaster> no_casters_;
  std::vector<Mesh> no_models_;
  MovingScene nothing_;
  ViewRenderer renderer_;
};

View kittiView(const Eigen::Isometry3d& T_world_camera) {
  const StereoCamera camera = kittiCamera();
  return {camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height, T_world_camera};
}

Eigen::Vector2d project(const View& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = view.T_world_camera.inverse() * point;
  return {view.fx * p.x() / p.z() + view.cx, view.fy * p.y() / p.z() + view.cy};
}

/// Centre of brightness within `radius` px of a place.
Eigen::Vector2d centroid(const cv::Mat1f& image, const Eigen::Vector2d& near, int radius) {
  double sum = 0.0;
  Eigen::Vector2d moment(0.0, 0.0);
  for (int row = std::max(0, int(near.y()) - radius); row <= std::min(image.rows - 1, int(near.y()) + radius); ++row)
    for (int col = std::max(0, int(near.x()) - radius); col <= std::min(image.cols - 1, int(near.x()) + radius);
         ++col) {
      sum += image(row, col);
      moment += image(row, col) * Eigen::Vector2d(col, row);
    }
  return moment / sum;
}

Eigen::Isometry3d pose(double x, double y, double z, double yaw, double pitch, double roll) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() =
      (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  result.translation() << x, y, z;
  return result;
}

Texture white() {
  return Texture(cv::Mat1f(1, 1, 1.0f), 1.0);
}

/// Places of small bright discs before a black sky, parallel to the plane z = 0.
std::vector<Eigen::Vector3d> markerPlaces() {
  std::vector<Eigen::Vector3d> places;
  for (int i = 0; i < 40; ++i) {
    const double depth = 6.0 + 1.37 * i;
    places.emplace_back(depth * (-0.62 + 0.031 * i), depth * (-0.14 + 0.083 * (i % 4)), depth);
  }
  return places;
}

Mesh markers() {
  constexpr int kSides = 24;
  Mesh mesh;
  for (const Eigen::Vector3d& place : markerPlaces()) {
    const double radius = 0.009 * place.z();  // 6.4 px at any depth
    const auto rim = [&](int i) -> Eigen::Vector3d {
      const double angle = 2.0 * M_PI * i / kSides;
      return place + radius * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    };
    for (int i = 0; i < kSides; i += 2) mesh.addQuad(place, rim(i), rim(i + 1), rim(i + 2), Material::kFlat, 1.0);
  }
  return mesh;
}

TEST(RenderGeometry, MarkersLieWhereTheyProjectToInBothViewsAndOverTime) {
  const Studio studio(plainWorld(markers(), white()));
  const double baseline = kittiCamera().baseline;
  double worst = 0.0, sum = 0.0;
  int count = 0;
  for (int frame = 0; frame < 5; ++frame) {
    const Eigen::Isometry3d T_world_left =
        pose(0.031 * frame, -0.017 * frame, 0.43 * frame, 0.004 * frame, -0.003 * frame, 0.006 * frame);
    for (const double right : {0.0, baseline}) {
      const View view = kittiView(T_world_left * Eigen::Translation3d(right, 0.0, 0.0));
      const cv::Mat1f image = studio.render(view);
      for (const Eigen::Vector3d& place : markerPlaces()) {
        const Eigen::Vector2d expected = project(view, place);
        if (expected.x() < 12 || expected.y() < 12 || expected.x() > view.width - 12 || expected.y() > view.height - 12)
          continue;
        const double error = (centroid(image, expected, 10) - expected).norm();
        worst = std::max(worst, error);
        sum += error;
        ++count;
      }
    }
  }
  ASSERT_GT(count, 200);
  EXPECT_LT(worst, 0.05);
  EXPECT_LT(sum / count, 0.03);
}

TEST(RenderGeometry, SixteenSamplesPutEveryMarkerWithinAThirtiethOfAPixel) {
  const Studio studio(plainWorld(markers(), white()));
  for (const double right : {0.0, kittiCamera().baseline}) {
    const View view = kittiView(pose(right, 0.0, 0.0, 0.0, 0.0, 0.0));
    const cv::Mat1f image = studio.render(view, 16);
    for (const Eigen::Vector3d& place : markerPlaces()) {
      const Eigen::Vector2d expected = project(view, place);
      if (expected.x() < 12 || expected.y() < 12 || expected.x() > view.width - 12 || expected.y() > view.height - 12)
        continue;
      EXPECT_LT((centroid(image, expected, 10) - expected).norm(), 0.033) << expected.transpose();
    }
  }
}

/// A texture of 4 m with one soft bright spot in its middle.
Texture spotTexture() {
  cv::Mat1f image(512, 512);
  const double middle = 255.5, sigma = 14.0;
  for (int row = 0; row < 512; ++row)
    for (int col = 0; col < 512; ++col)
      image(row, col) = static_cast<float>(
          std::exp(-0.5 * ((row - middle) * (row - middle) + (col - middle) * (col - middle)) / (sigma * sigma)));
  return Texture(image, 4.0);
}

TEST(RenderGeometry, TexturedSpotsLieWhereTheyProjectToAtAllDistances) {
  // 4 m panels that face the camera: the texture's middle is the panel's, whatever the level of the pyramid.
  for (const double depth : {5.0, 9.0, 17.0, 33.0, 61.0}) {
    const Eigen::Vector3d place(0.013 * depth, -0.021 * depth, depth);
    Mesh mesh;
    mesh.addPanel(place - Eigen::Vector3d(2, 2, 0), {4, 0, 0}, {0, 4, 0}, Material::kConcrete, 1.0);
    const Studio studio(plainWorld(mesh, spotTexture()));
    for (const double right : {0.0, 0.5371}) {
      const View view = kittiView(pose(right, 0.0, 0.0, 0.0, 0.0, 0.0));
      const Eigen::Vector2d expected = project(view, place);
      const int radius = static_cast<int>(4.5 * 14.0 / 128.0 * view.fx / depth);
      EXPECT_LT((centroid(studio.render(view), expected, radius) - expected).norm(), 0.02) << "at " << depth << " m";
    }
  }
}

TEST(RenderGeometry, TexturedSpotsOnAnObliquePlaneHaveTheRightDisparity) {
  // A floor 1.65 m below, seen at a grazing angle: the shift of the texture between the views is f b / Z of the floor.
  for (const double depth : {7.0, 12.0, 20.0}) {
    const Eigen::Vector3d place(0.3, 1.65, depth);
    Mesh mesh;
    mesh.addPanel(place - Eigen::Vector3d(2, 0, 2), {4, 0, 0}, {0, 0, 4}, Material::kConcrete, 1.0);
    const Studio studio(plainWorld(mesh, spotTexture()));
    const View left = kittiView(Eigen::Isometry3d::Identity());
    const View right = kittiView(pose(0.5371, 0, 0, 0, 0, 0));
    const Eigen::Vector2d in_left = project(left, place), in_right = project(right, place);
    const Eigen::Vector2d l = centroid(studio.render(left), in_left, 60);
    const Eigen::Vector2d r = centroid(studio.render(right), in_right, 60);
    EXPECT_NEAR((l - r).x(), left.fx * 0.5371 / depth, 0.05 + 0.004 * left.fx * 0.5371 / depth)
        << "at " << depth << " m";
    EXPECT_NEAR((l - r).y(), 0.0, 0.01);
  }
}

TEST(RenderGeometry, AFarPlaneShiftsByItsDisparityToAHundredthOfAPixel) {
  // Fine noise, also beyond what the pixels resolve: what is left after the filter has to move as one.
  Mesh mesh;
  const double depth = 23.7;
  mesh.addPanel({-30, -10, depth}, {60, 0, 0}, {0, 20, 0}, Material::kConcrete, 1.0);
  const Studio studio(plainWorld(mesh, Texture(0.5 + 0.12 * makeNoise(512, 0.8, 5), 6.0)));
  const cv::Mat1f left = studio.render(kittiView(Eigen::Isometry3d::Identity()));
  const cv::Mat1f right = studio.render(kittiView(pose(0.5371, 0, 0, 0, 0, 0)));
  const double disparity = 707.0912 * 0.5371 / depth;
  const int whole = static_cast<int>(std::lround(disparity));
  const cv::Rect region(200, 60, 800, 250), shifted(200 - whole, 60, 800, 250);
  cv::Mat1f window;
  cv::createHanningWindow(window, region.size(), CV_32F);
  cv::Mat1f a = left(region).clone(), b = right(shifted).clone();
  const cv::Point2d rest = cv::phaseCorrelate(b - cv::mean(b)[0], a - cv::mean(a)[0], window);
  EXPECT_NEAR(rest.x, whole - disparity, 0.06) << "phase correlation itself is good to some hundredths";
  EXPECT_NEAR(rest.y, 0.0, 0.03);

  // Least squares over the region is sharper: a(x) = b(x) + gradient * residual.
  double numerator = 0.0, denominator = 0.0;
  for (int row = 1; row + 1 < b.rows; ++row)
    for (int col = 1; col + 1 < b.cols; ++col) {
      const double gradient = 0.5 * (a(row, col + 1) - a(row, col - 1));
      numerator += gradient * (b(row, col) - a(row, col));
      denominator += gradient * gradient;
    }
  // b is the view at x - whole; its content at x is a's at x + (disparity - whole).
  EXPECT_NEAR(numerator / denominator, disparity - whole, 0.02);
}

TEST(RenderGeometry, DepthIsThatOfThePlaneAtThePixelsCentre) {
  Mesh mesh;
  // Plane through (0, 0, 10) with normal (0.3, 0.1, -1).
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, 0.1, -1.0).normalized(), middle(0, 0, 10);
  const Eigen::Vector3d s = normal.unitOrthogonal(), t = normal.cross(s);
  mesh.addPanel(middle - 100 * s - 100 * t, 200 * s, 200 * t, Material::kFlat, 1.0);
  const Studio studio(plainWorld(mesh, white()));
  const View view = kittiView(Eigen::Isometry3d::Identity());
  const cv::Mat1f depth = studio.depth(view);
  for (int row = 0; row < view.height; row += 25)
    for (int col = 0; col < view.width; col += 31) {
      const Eigen::Vector3d ray((col - view.cx) / view.fx, (row - view.cy) / view.fy, 1.0);
      EXPECT_NEAR(depth(row, col), normal.dot(middle) / normal.dot(ray), 1e-3);
    }
}

TEST(RenderGeometry, AnEdgeCoversPixelsByTheirShare) {
  // Left half white; the edge lies at x = 0.3 px right of the centre of column 602 for all rows.
  Mesh mesh;
  const StereoCamera camera = kittiCamera();
  const double edge = (602.3 - camera.cx) / camera.fx * 10.0;
  mesh.addPanel({edge - 30.0, -10.0, 10.0}, {30.0, 0, 0}, {0, 20, 0}, Material::kFlat, 1.0);
  const Studio studio(plainWorld(mesh, white()));
  const cv::Mat1f image = studio.render(kittiView(Eigen::Isometry3d::Identity()), 16);
  EXPECT_FLOAT_EQ(image(100, 601), 1.0f);
  EXPECT_NEAR(image(100, 602), 0.8f, 0.0626);
  EXPECT_FLOAT_EQ(image(100, 603), 0.0f);
}

}  // namespace sdvo::render::test_render_geometry
