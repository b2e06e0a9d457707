#pragma once

#include <opencv2/core/version.hpp>

// SIFT moved from the non-free modules to features2d in 4.4.
#define SDVO_HAVE_SIFT (CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 4))
