#pragma once

#include <string>

#include "stereo_descriptor_vo/rig/row_delay.hpp"
#include "stereo_descriptor_vo/rig/row_readout.hpp"

namespace sdvo {

/// In words, if the rows of both images are not of one moment; empty: nothing is proved.
std::string doubtOfShutters(const RowDelay::Estimate& right, const RowReadout::Estimate& readout);

}  // namespace sdvo
