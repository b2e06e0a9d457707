// calib.txt of KITTI: whatever stands in it, a camera or one std::runtime_error comes out.
#include <stdexcept>

#include "fuzz_file.hpp"
#include "stereo_descriptor_vo/data/kitti_dataset.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string path = sdvo::fuzzedFile("calib.txt", data, size);
  for (const auto cameras : {sdvo::KittiCameras::kGrey, sdvo::KittiCameras::kColour}) try {
      const sdvo::StereoCamera camera = sdvo::readKittiCalibration(path, cameras);
      if (!(camera.fx > 0.0 && camera.fy > 0.0 && camera.baseline > 0.0)) __builtin_trap();
    } catch (const std::runtime_error&) {
    }
  return 0;
}
