#include "shutter_check.hpp"

#include <cmath>

#include "../common/text.hpp"

namespace sdvo {

std::string doubtOfShutters(const RowDelay::Estimate& right, const RowReadout::Estimate& readout) {
  if (readout.isRolling())
    return text(0, "rows are taken one after the other, in ", 1e3 * readout.value,
                " ms at least: the cameras need a global shutter");
  if (!(std::abs(right.proved()) > RowDelay::kWarn)) return "";
  return text(1, "right images are taken ", 1e3 * std::abs(right.value), " +- ", 1e3 * right.sigma, " ms ",
              right.value > 0.0 ? "after" : "before",
              " left ones: trigger both cameras together; calibration/right_delay takes a known delay");
}

}  // namespace sdvo
