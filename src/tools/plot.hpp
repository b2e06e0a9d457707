#pragma once

#include <string>
#include <vector>

namespace sdvo {

/// A line through points; NaN interrupts it.
struct Curve {
  std::string name;
  const char* colour;
  std::vector<double> x, y;
};

/// How curves are drawn.
struct Axes {
  enum class Style {
    kLines,
    kEqualScales,  ///< a metre is as long in x as in y
    kStacked,      ///< areas, each upon the one before; curves have the same x
  };

  std::string title, x, y;  ///< with units
  Style style = Style::kLines;
};

/// The curves as HTML that needs no other file: title, legend, and an SVG that is legible from 320 px on. Many points
/// are averaged. Where the largest values are a thousand times the usual ones, y is logarithmic.
std::string plot(const Axes& axes, std::vector<Curve> curves);

/// A bar along the time: the colour of each item from left to right. Where several items share a pixel, the largest of
/// `ranks` is shown.
std::string band(const std::vector<int>& ranks, const std::vector<const char*>& colours);

}  // namespace sdvo
