// libviso2 over a drive: viso_driver DRIVE POSES [HALF], HALF 0 or 1: match.half_resolution, whose default is 1.
#include <viso_stereo.h>

#include "recorded_drive.hpp"

int main(int count, char** words) {
  if (count < 3) {
    std::fprintf(stderr, "usage: viso_driver DRIVE POSES [HALF]\n");
    return 2;
  }
  cv::setNumThreads(1);
  const RecordedDrive drive(words[1]);
  VisualOdometryStereo::parameters parameters;
  parameters.calib.f = drive.fx;
  parameters.calib.cu = drive.cx;
  parameters.calib.cv = drive.cy;
  parameters.base = drive.baseline;
  if (count > 3) parameters.match.half_resolution = std::atoi(words[3]);
  VisualOdometryStereo odometry(parameters);

  Matrix pose = Matrix::eye(4), motion = Matrix::eye(4);
  FILE* poses = openToWrite(words[2]);
  int lost = 0;
  double cpu = 0.0, wall = 0.0;
  for (size_t i = 0; i < drive.size(); ++i) {
    const double cpu_before = cpuSeconds(), wall_before = wallSeconds();
    int32_t size[] = {drive.width, drive.height, static_cast<int32_t>(drive.left[i].step)};
    const bool is_followed = odometry.process(drive.left[i].data, drive.right[i].data, size);
    cpu += cpuSeconds() - cpu_before;
    wall += wallSeconds() - wall_before;
    if (i > 0) {
      // A lost pair moves as the one before: libviso2 leaves that to its caller.
      if (is_followed) {
        motion = Matrix::inv(odometry.getMotion());
      } else {
        ++lost;
      }
      pose = pose * motion;
    }
    writePose(poses, [&](int row, int column) { return pose.val[row][column]; });
  }
  std::fclose(poses);
  report("libviso2", drive.size(), cpu, wall, lost);
}
