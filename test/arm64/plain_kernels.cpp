// Preloaded: the program's kernels take their plain forms.
#include "stereo_descriptor_vo/common/processor.hpp"

namespace {
const bool plain = (sdvo::allowVectorKernels(false), true);
}
