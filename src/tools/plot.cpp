#include "plot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "../common/statistics.hpp"
#include "../common/text.hpp"
#include "page.hpp"

namespace sdvo {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostPoints = 400;  // of a curve: more than one a pixel is not seen
constexpr double kWidth = 360.0, kHeight = 230.0, kLeft = 44.0, kRight = 10.0, kTop = 8.0, kBottom = 34.0;  // px

/// The mean of every `count` points that follow each other; none where one of them is none.
std::vector<double> averaged(const std::vector<double>& values, std::size_t count) {
  std::vector<double> means;
  for (std::size_t begin = 0; begin < values.size(); begin += count) {
    const std::size_t end = std::min(begin + count, values.size());
    double sum = 0.0;
    for (std::size_t i = begin; i < end; ++i) sum += values[i];
    means.push_back(sum / static_cast<double>(end - begin));
  }
  return means;
}

struct Interval {
  double min = std::numeric_limits<double>::infinity(), max = -min;

  void extend(double value) {
    if (!std::isfinite(value)) return;
    min = std::min(min, value);
    max = std::max(max, value);
  }
  double length() const { return max - min; }
};

/// 1, 2 or 5 times a power of ten, so that at most six steps fill the interval.
double tickStep(const Interval& interval) {
  const double least = interval.length() / 6.0, decade = std::pow(10.0, std::floor(std::log10(least)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * decade >= least) return factor * decade;
  return 10.0 * decade;
}

/// An axis: values to pixels, and where its ticks are.
class Scale {
 public:
  Scale(Interval values, double from, double to, bool logarithmic)
      : values_(values), from_(from), to_(to), logarithmic_(logarithmic) {
    if (!(values_.length() > 0.0)) {
      const double middle = std::isfinite(values_.min) ? values_.min : 0.0;
      values_ = {middle - 0.5, middle + 0.5};
    }
  }

  double operator()(double value) const { return from_ + (value - values_.min) / values_.length() * (to_ - from_); }

  std::vector<std::pair<double, std::string>> ticks() const {
    std::vector<std::pair<double, std::string>> ticks;
    const double step = logarithmic_ ? std::max(1.0, tickStep(values_)) : tickStep(values_);
    const int digits = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
    for (double value = std::ceil(values_.min / step) * step; value <= values_.max + 1e-9 * step; value += step) {
      const double shown = std::abs(value) < 1e-9 * step ? 0.0 : value;
      ticks.emplace_back((*this)(shown), logarithmic_ ? text(0, "1e", shown) : text(digits, shown));
    }
    return ticks;
  }

 private:
  Interval values_;
  double from_, to_;
  bool logarithmic_;
};

void stack(std::vector<Curve>& curves) {
  for (std::size_t i = 1; i < curves.size(); ++i)
    for (std::size_t j = 0; j < curves[i].y.size(); ++j) curves[i].y[j] += curves[i - 1].y[j];
}

/// Two intervals with the same number of units a pixel; the shorter one grows around its middle.
void equalise(Interval& x, Interval& y, double width, double height) {
  const double unit = std::max({x.length() / width, y.length() / height, 1e-3});
  for (const auto& [interval, pixels] : {std::pair(&x, width), std::pair(&y, height)}) {
    const double middle = 0.5 * (interval->min + interval->max);
    *interval = {middle - 0.5 * unit * pixels, middle + 0.5 * unit * pixels};
  }
}

std::string pathOf(const Curve& curve, const Scale& x, const Scale& y) {
  std::string path;
  bool is_drawn = false;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    const bool is_there = std::isfinite(curve.x[i]) && std::isfinite(curve.y[i]);
    // A point between two that are missing is a dot.
    if (is_there) path += text(1, is_drawn ? "L" : "M", x(curve.x[i]), " ", y(curve.y[i]), is_drawn ? "" : "h.1");
    is_drawn = is_there;
  }
  return path;
}

/// From the upper edge of the area back along the lower one, that of `below` or the axis.
std::string areaOf(const Curve& curve, const Curve* below, const Scale& x, const Scale& y) {
  std::string points;
  const auto add = [&](double at, double value) {
    points += text(1, x(at), ",", y(std::isfinite(value) ? value : 0.0), " ");
  };
  for (std::size_t i = 0; i < curve.x.size(); ++i) add(curve.x[i], curve.y[i]);
  for (std::size_t i = curve.x.size(); i-- > 0;) add(curve.x[i], below ? below->y[i] : 0.0);
  return points;
}

}  // namespace

std::string plot(const Axes& axes, std::vector<Curve> curves) {
  const bool are_stacked = axes.style == Axes::Style::kStacked, are_equal = axes.style == Axes::Style::kEqualScales;
  Interval x_values, y_values;
  std::vector<double> positive;
  for (Curve& curve : curves) {
    const std::size_t count = (curve.x.size() + kMostPoints - 1) / kMostPoints;
    if (count > 1) curve.x = averaged(curve.x, count), curve.y = averaged(curve.y, count);
  }
  if (are_stacked) stack(curves);
  for (const Curve& curve : curves)
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      x_values.extend(curve.x[i]);
      y_values.extend(curve.y[i]);
      if (curve.y[i] > 0.0) positive.push_back(curve.y[i]);
    }
  // Of the usual values; rounding leaves much smaller ones.
  const double least = 0.1 * quantile(positive, 0.1);
  const bool is_logarithmic = axes.style == Axes::Style::kLines && y_values.min >= 0.0 && y_values.max > 1e4 * least;
  if (is_logarithmic) {
    y_values = {std::floor(std::log10(least)), std::ceil(std::log10(y_values.max))};
    for (Curve& curve : curves)
      for (double& value : curve.y) value = value > least ? std::log10(value) : kMissing;
  } else if (are_equal) {
    equalise(x_values, y_values, kWidth - kLeft - kRight, kHeight - kTop - kBottom);
  } else {
    y_values.extend(0.0);
  }
  const Scale x(x_values, kLeft, kWidth - kRight, false), y(y_values, kHeight - kBottom, kTop, is_logarithmic);

  std::ostringstream html;
  html << "<figure><figcaption><b>" << escaped(axes.title) << "</b>";
  for (const Curve& curve : curves)
    if (!curve.name.empty())
      html << " <span style='white-space:nowrap;color:" << curve.colour << "'>&#9632; " << escaped(curve.name)
           << "</span>";
  html << "</figcaption><svg viewBox='0 0 " << kWidth << " " << kHeight << "' role='img'>";
  for (const auto& [at, label] : x.ticks())
    html << text(1, "<path class='g' d='M", at, " ", kTop, "V", kHeight - kBottom, "'/><text x='", at, "' y='",
                 kHeight - kBottom + 13.0, "' text-anchor='middle'>", label, "</text>");
  for (const auto& [at, label] : y.ticks())
    html << text(1, "<path class='g' d='M", kLeft, " ", at, "H", kWidth - kRight, "'/><text x='", kLeft - 4.0, "' y='",
                 at + 4.0, "' text-anchor='end'>", label, "</text>");
  for (std::size_t i = 0; i < curves.size(); ++i) {
    if (are_stacked)
      html << "<polygon fill='" << curves[i].colour << "' points='"
           << areaOf(curves[i], i > 0 ? &curves[i - 1] : nullptr, x, y) << "'/>";
    else
      html << "<path class='c' stroke='" << curves[i].colour << "' d='" << pathOf(curves[i], x, y) << "'/>";
  }
  html << text(1, "<text x='", kWidth - kRight, "' y='", kHeight - 4.0, "' text-anchor='end'>", escaped(axes.x),
               "</text><text x='4' y='", kHeight - 4.0, "'>", escaped(axes.y), " &#8593;</text></svg></figure>\n");
  return html.str();
}

std::string band(const std::vector<int>& ranks, const std::vector<const char*>& colours) {
  const std::size_t columns = std::min(ranks.size(), kMostPoints);
  std::vector<int> worst(columns, 0);
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    int& column = worst[i * columns / ranks.size()];
    column = std::max(column, ranks[i]);
  }
  std::ostringstream html;
  html << "<svg class='band' viewBox='0 0 " << columns << " 1' preserveAspectRatio='none' role='img'>";
  for (std::size_t begin = 0, end = 0; begin < columns; begin = end) {
    while (end < columns && worst[end] == worst[begin]) ++end;
    html << "<rect x='" << begin << "' width='" << end - begin << "' height='1' fill='"
         << colours[static_cast<std::size_t>(worst[begin])] << "'/>";
  }
  html << "</svg>\n";
  return html.str();
}

}  // namespace sdvo
