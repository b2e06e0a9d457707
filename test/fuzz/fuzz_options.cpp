// The YAML file of options: options within their ranges come out, or one error that names the file or the option.
#include <stdexcept>

#include "../../src/config/pipeline_options.hpp"
#include "fuzz_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    sdvo::PipelineOptions options = sdvo::readPipelineOptions(sdvo::fuzzedFile("options.yaml", data, size), {});
    for (const sdvo::Option& option : sdvo::listOptions(options)) option.check();
  } catch (const std::runtime_error&) {
  } catch (const std::invalid_argument&) {
  }
  return 0;
}
