#include "drive_renderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "camera_pose.hpp"
#include "random.hpp"

namespace sdvo::render {

void Misalignment::describe(OptionList& list) {
  const std::string unknown = " of the right camera that calib.txt does not know of";
  list.add("disparity_offset", disparity_offset, {-20.0, 20.0}, "px", "added to every disparity, unknown to calib.txt");
  list.add("right_rotation_x", rotation_x, {-5.0, 5.0}, "deg", "rotation about x (upwards)" + unknown);
  list.add("right_rotation_y", rotation_y, {-5.0, 5.0}, "deg", "rotation about y (to the right)" + unknown);
  list.add("right_rotation_z", rotation_z, {-5.0, 5.0}, "deg", "rotation about z (clockwise)" + unknown);
}

void Shutters::describe(OptionList& list) {
  list.add("right_delay", right_delay, {-1.0, 1.0}, "s", "the right image is taken that much later than the left one");
  list.add("readout", readout, {0.0, 0.1}, "s",
           "rolling shutters: the last row is taken that much later than the first");
}

void Mount::describe(OptionList& list) {
  list.add("mount_x", x, {-2.0, 2.0}, "m", "the camera sits that much to the right of the trajectory's");
  list.add("mount_z", z, {-2.0, 2.0}, "m", "the camera sits that much ahead of the trajectory's");
  list.add("mount_yaw", yaw, {-180.0, 180.0}, "deg", "the camera looks that much to the right of the trajectory's");
}

Eigen::Isometry3d Mount::T_path_left() const {
  return cameraPose(x, 0.0, z, yaw * M_PI / 180.0, 0.0, 0.0);
}

void RenderOptions::describe(OptionList& list) {
  list.add("samples", samples, {1, 16}, "rays", "rays per pixel: 1, 4 or 16");
  list.add("moving_share", moving_share, {0.0, 0.6}, "fraction", "share of pixels on moving cars, mean over the drive");
  list.add("dropped_frames", dropped_frames, {0.0, 0.9}, "fraction", "share of pairs that are missing");
  list.add("seed", seed, {0, 2147483647}, "", "everything random follows from it");
  effects.describe(list);
  misalignment.describe(list);
  shutters.describe(list);
  mount.describe(list);
}

DriveRenderer::DriveRenderer(const DrivePath& path, Scenery scenery, const StereoCamera& camera,
                             const RenderOptions& options, int first, int count, int threads)
    : path_(path),
      camera_(camera),
      options_(options),
      T_path_left_(options.mount.T_path_left()),
      first_(first),
      device_(threads) {
  camera_.check();
  checked(options_);
  const auto seed = static_cast<std::uint64_t>(options_.seed);
  world_ = makeWorld(scenery, path_, seed);
  caster_ = std::make_unique<RayCaster>(device_, world_.mesh);
  lightWorld(world_, *caster_, threads);
  if (world_.road) {
    setDensity(0.0);
    for (const Mesh& model : traffic_.models()) car_casters_.emplace_back(device_, model);
  }
  renderer_ = std::make_unique<ViewRenderer>(world_, *caster_, traffic_.models());
  if (world_.road && options_.moving_share > 0.0) tuneTraffic(first, count);
}

View DriveRenderer::view(int side, const Eigen::Isometry3d& T_world_left) const {
  View view{camera_.fx, camera_.fy, camera_.cx, camera_.cy, camera_.width, camera_.height, T_world_left};
  if (side == 1) {
    const Misalignment& wrong = options_.misalignment;
    Eigen::Isometry3d T_left_right = Eigen::Isometry3d::Identity();
    T_left_right.translation().x() = camera_.baseline;
    T_left_right.linear() = (Eigen::AngleAxisd(wrong.rotation_z * M_PI / 180.0, Eigen::Vector3d::UnitZ()) *
                             Eigen::AngleAxisd(wrong.rotation_y * M_PI / 180.0, Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(wrong.rotation_x * M_PI / 180.0, Eigen::Vector3d::UnitX()))
                                .toRotationMatrix();
    view.T_world_camera = T_world_left * T_left_right;
    view.cx -= wrong.disparity_offset;
  }
  return view;
}

cv::Mat1f DriveRenderer::brightness(int side, double time, Worker& worker) const {
  constexpr int kTogether = 4;  // rows (chosen): during a readout of 25 ms a turn of 100 deg/s moves them by 0.1 px
  cv::Mat1f image(camera_.height, camera_.width, 0.0f);
  const double readout = options_.shutters.readout;
  const int step = readout > 0.0 ? kTogether : camera_.height;
  for (int top = 0; top < camera_.height; top += step) {
    const int bottom = std::min(top + step, camera_.height);
    const double middle = 0.5 * (top + bottom) / camera_.height;
    addRows(side, time + readout * (middle - 0.5), worker, top, image.rowRange(top, bottom));
  }
  return image;
}

/// The rows of an image from `top` on.
void DriveRenderer::addRows(int side, double time, Worker& worker, int top, cv::Mat1f rows) const {
  const auto rowsView = [&](double moment) {
    View rows_view = view(side, leftPoseAt(moment));
    rows_view.cy -= top;
    rows_view.height = rows.rows;
    return rows_view;
  };
  const double exposure = options_.effects.motion_blur;
  if (exposure <= 0.0) {
    worker.place(traffic_.at(time));
    renderer_->add(rowsView(time), worker, options_.samples, 0.0f, 0.0f, 1.0f, rows);
    return;
  }
  // One ray per pixel and moment; the rays' places within the pixel differ so that edges at rest are smooth as well.
  const int moments = momentsOfExposure(time);
  for (int i = 0; i < moments; ++i) {
    const double moment = time + exposure * ((i + 0.5) / moments - 0.5);
    worker.place(traffic_.at(moment));
    const int shuffled = i * 5 % moments;
    const float across = (static_cast<float>(i) + 0.5f) / static_cast<float>(moments) - 0.5f;
    const float down = (static_cast<float>(shuffled) + 0.5f) / static_cast<float>(moments) - 0.5f;
    renderer_->add(rowsView(moment), worker, 1, across, down, 1.0f / static_cast<float>(moments), rows);
  }
}

int DriveRenderer::momentsOfExposure(double time) const {
  const double half = 0.5 * options_.effects.motion_blur;
  const Eigen::Matrix3d turn = path_.poseAt(time - half).linear().transpose() * path_.poseAt(time + half).linear();
  const double pixels = camera_.fx * Eigen::AngleAxisd(turn).angle();
  // A power of two has no factor in common with the 5 that shuffles the rays.
  int moments = std::max(8, options_.samples);
  while (moments < pixels && moments < kMostMoments) moments *= 2;
  return moments;
}

StereoPair DriveRenderer::render(int frame, Worker& worker) const {
  const double time = frame / path_.rate();
  const auto seed = static_cast<std::uint64_t>(options_.seed);
  StereoPair pair;
  for (int side = 0; side < 2; ++side) {
    const double taken = side == 0 ? time : time + options_.shutters.right_delay;
    (side == 0 ? pair.left : pair.right) = options_.effects.apply(brightness(side, taken, worker), taken, seed,
                                                                  2 * static_cast<std::uint64_t>(frame) + side);
  }
  return pair;
}

Truth DriveRenderer::truth(int frame, Worker& worker) const {
  const double time = frame / path_.rate(), next_time = (frame + 1) / path_.rate();
  const View now = view(0, leftPoseAt(time));
  const Eigen::Isometry3d T_next_world = leftPoseAt(next_time).inverse();
  worker.place(traffic_.at(time));
  const Hits hits = renderer_->trace(now, worker);

  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  Truth truth{hits.depth, cv::Mat1f(hits.depth.size(), kNone), cv::Mat2f(hits.depth.size(), cv::Vec2f(kNone, kNone)),
              cv::Mat1b(hits.depth.size(), std::uint8_t{0})};
  std::vector<Eigen::Isometry3d> motions;  // of the cars, from now to the next frame
  for (const Traffic::Car& car : worker.cars())
    motions.push_back(traffic_.poseOf(car.id, next_time) * car.T_world_car.inverse());
  for (int row = 0; row < now.height; ++row)
    for (int column = 0; column < now.width; ++column) {
      const float depth = hits.depth(row, column);
      if (!std::isfinite(depth)) continue;
      truth.disparity(row, column) = static_cast<float>(camera_.disparity(depth));
      Eigen::Vector3d point = now.T_world_camera.translation() + depth * now.direction(column, row);
      const int car = hits.car(row, column);
      if (car >= 0) {
        truth.moving(row, column) = 1;
        point = motions[static_cast<std::size_t>(car)] * point;
      }
      point = T_next_world * point;
      if (point.z() <= 0.0) continue;
      truth.flow(row, column) = {static_cast<float>(camera_.fx * point.x() / point.z() + camera_.cx - column),
                                 static_cast<float>(camera_.fy * point.y() / point.z() + camera_.cy - row)};
    }
  return truth;
}

bool DriveRenderer::isDropped(int frame) const {
  if (frame == first_) return false;
  return Random(static_cast<std::uint64_t>(options_.seed) + 977, static_cast<std::uint64_t>(frame))
      .chance(options_.dropped_frames);
}

void DriveRenderer::setDensity(double density) {
  traffic_ = Traffic(path_, *world_.road, *world_.ground, density, static_cast<std::uint64_t>(options_.seed));
}

double DriveRenderer::measureMovingShare(int first, int count) const {
  constexpr int kShrink = 8, kFrames = 60;
  Worker worker = makeWorker();
  View small = view(0, Eigen::Isometry3d::Identity());
  for (double* value : {&small.fx, &small.fy, &small.cx, &small.cy}) *value /= kShrink;
  small.width = std::max(1, small.width / kShrink);
  small.height = std::max(1, small.height / kShrink);
  int moving = 0;
  const int frames = std::min(count, kFrames);
  for (int i = 0; i < frames; ++i) {
    const double time = (first + static_cast<double>(i) * count / frames) / path_.rate();
    small.T_world_camera = leftPoseAt(time);
    worker.place(traffic_.at(time));
    const Hits hits = renderer_->trace(small, worker);
    moving += cv::countNonZero(hits.car >= 0);
  }
  return static_cast<double>(moving) / (static_cast<double>(frames) * small.width * small.height);
}

void DriveRenderer::tuneTraffic(int first, int count) {
  // The share grows with the density, but not evenly: halve the interval on a logarithmic scale.
  double low = std::log(0.02), high = std::log(30.0);
  double best_density = 0.0, best_error = options_.moving_share;
  for (int step = 0; step < 10; ++step) {
    const double middle = 0.5 * (low + high);
    setDensity(std::exp(middle));
    const double share = measureMovingShare(first, count);
    if (std::abs(share - options_.moving_share) < best_error) {
      best_error = std::abs(share - options_.moving_share);
      best_density = std::exp(middle);
      moving_share_ = share;
    }
    (share < options_.moving_share ? low : high) = middle;
  }
  setDensity(best_density);
}

}  // namespace sdvo::render
