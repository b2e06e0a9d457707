// The files of a EuRoC folder in a row with '%' between them: sensor.yaml of both cameras and the list of images.
// Frames come out, or one std::runtime_error.
#include <algorithm>
#include <stdexcept>

#include "../../src/data/euroc_dataset.hpp"
#include "fuzz_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::uint8_t* end = data + size;
  std::string sensor, list;
  for (const std::string file : {"cam0/sensor.yaml", "cam1/sensor.yaml", "cam0/data.csv"}) {
    const std::uint8_t* stop = std::find(data, end, '%');
    const std::string path = sdvo::fuzzedFile("mav0/" + file, data, static_cast<std::size_t>(stop - data));
    (file == "cam0/data.csv" ? list : sensor) = path;
    data = std::min(stop + 1, end);
  }
  const std::filesystem::path mav0 = std::filesystem::path(sensor).parent_path().parent_path();
  std::filesystem::copy_file(list, mav0 / "cam1/data.csv", std::filesystem::copy_options::overwrite_existing);
  try {
    if (sdvo::EurocSequence(mav0.string()).rectification().raw(0).size.width <= 0) __builtin_trap();
  } catch (const std::runtime_error&) {
  }
  return 0;
}
