#include "run_nodelet.hpp"

int main(int argc, char** argv) {
  return sdvo::runNodelet(argc, argv, "place_recognition", "stereo_descriptor_vo/PlaceRecognition");
}
