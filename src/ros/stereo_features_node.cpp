#include "run_nodelet.hpp"

int main(int argc, char** argv) {
  return sdvo::runNodelet(argc, argv, "stereo_features", "stereo_descriptor_vo/StereoFeatures");
}
