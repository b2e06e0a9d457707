#include "check_page.hpp"

#include <algorithm>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "../common/text.hpp"

namespace sdvo {
namespace {

std::string escaped(const std::string& words) {
  std::string html;
  for (const char c : words) switch (c) {
      case '&':
        html += "&amp;";
        break;
      case '<':
        html += "&lt;";
        break;
      case '>':
        html += "&gt;";
        break;
      default:
        html += c;
    }
  return html;
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  using Bits = boost::archive::iterators::transform_width<std::vector<std::uint8_t>::const_iterator, 6, 8>;
  using Encoder = boost::archive::iterators::base64_from_binary<Bits>;
  std::string encoded{Encoder(bytes.begin()), Encoder(bytes.end())};
  encoded.append((3 - bytes.size() % 3) % 3, '=');
  return encoded;
}

const char* colourOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kOk:
      return "#2e7d32";
    case Verdict::kWarn:
      return "#ef6c00";
    case Verdict::kFail:
      return "#c62828";
    case Verdict::kOpen:
      break;
  }
  return "#757575";
}

/// White is no difference, full red 2 px.
std::string cellOf(double dv) {
  if (std::isnan(dv)) return "<td class='n'>-</td>";
  const int other = 255 - static_cast<int>(std::min(std::abs(dv) / 2.0, 1.0) * 200.0);
  return text(2, "<td style='background:rgb(255,", other, ",", other, ")'>", dv, "</td>");
}

}  // namespace

void writeCheckPage(const std::string& path, const std::string& camera, const std::vector<Finding>& findings,
                    const cv::Mat& rows, const cv::Mat& picture) {
  std::ofstream file(path);
  file << "<!doctype html><meta charset='utf-8'><title>check_camera</title><style>"
          "body{font:15px sans-serif;max-width:70em;margin:2em auto}td,th{padding:.3em .7em;text-align:left;"
          "border-bottom:1px solid "
          "#ddd;vertical-align:top}table{border-collapse:collapse}.v{color:#fff;font-weight:bold}"
          ".n{color:#999}img{max-width:100%}</style>\n<h1>"
       << escaped(camera) << "</h1>\n<table><tr><th>step<th><th>found<th>what to do</tr>\n";
  for (const Finding& finding : findings)
    file << "<tr><td>" << escaped(finding.step) << "<td class='v' style='background:" << colourOf(finding.verdict)
         << "'>" << toString(finding.verdict) << "<td>" << escaped(finding.what) << "<td>" << escaped(finding.remedy)
         << "</tr>\n";
  file << "</table>\n";
  if (!rows.empty()) {
    file << "<h2>Rows of the right image against the left one, px</h2>\n<table>";
    for (int row = 0; row < rows.rows; ++row) {
      file << "<tr>";
      for (int column = 0; column < rows.cols; ++column) file << cellOf(rows.at<double>(row, column));
      file << "</tr>\n";
    }
    file << "</table>\n<p>As seen in the image; positive: lower in the right image.</p>\n";
  }
  if (!picture.empty()) {
    std::vector<std::uint8_t> png;
    cv::imencode(".png", picture, png);
    file << "<h2>A pair, left above right</h2>\n<img alt='left above right' src='data:image/png;base64," << base64(png)
         << "'>\n";
  }
  if (!file.flush()) throw std::runtime_error("cannot write " + path);
}

}  // namespace sdvo
