#include "run_nodelet.hpp"

int main(int argc, char** argv) {
  return sdvo::runNodelet(argc, argv, "visual_odometry", "stereo_descriptor_vo/VisualOdometry");
}
